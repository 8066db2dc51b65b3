"""A foot load on the twin: its effect on the leg's tables and on the drive torque (physics.md section 9).

The tables are linear in the load, which may change with every gait cycle: an estimated load of a given shape
and size, or the mean of a measured force.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.compiled.kernel import kernel
from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.clearance.stepper import loaded_tables, put_force
from leg_wear_monitor.dynamics.clearance.tables import POINTS
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.arrays import Floats, body_names
from leg_wear_monitor.mechanism.person import PHASES, nominal_stance, upwards
from leg_wear_monitor.mechanism.position import TURN, Linkage, one_cycle, point_motion

# A measured force on the toe: its mean over gait cycles at each point of the leg's tables.
#
# The kernels take ``load``, the `LoadRows`. A row is the number of a point of the tables, POINTS in a turn of
# the crank; between two points it has a fraction. White noise of a sensor would wear an unloaded joint: noise
# of 5 % of the peak nearly four times as fast as the load itself (joint J under 300 N, samples at 200 Hz). So
# the mean over gait cycles acts, smoothed, and a small force counts as none.


# s: a longer time between samples is a gap; at twenty samples a second a stance has eight
LONGEST_PUSH = 0.05
_LEARNED = 10.0  # gait cycles over which the force is averaged
_SMOOTH = 0.008  # standard deviation of the smoothing window [turns]
# Fractions of the peak: a smaller vertical force than the first counts as none, a larger one than the second
# acts as it is, with a smooth transition, since a jump would be an impact. Gait analysis takes 20 to 30 N as
# the least force of a standing foot.
_NONE, _SURE = 0.02, 0.08


class LoadRows(NamedTuple):
    """The measured force at the points of the tables.

    Attributes
    ----------
    axis : (N, 2) array
        First axis of the samples' frame at each row; the second axis is a quarter turn further.
    up : (2,) array
        Unit vector upwards.
    mean : (N, 2) array
        Mean force over gait cycles along the axes of the mechanism [N]; (0, 2) if no measured force acts.
    learned : (N,) array
        Number of gait cycles in the mean, at most 10.
    """

    axis: Floats
    up: Floats
    mean: Floats
    learned: Floats


def _axis(linkage: Linkage, is_of_foot: bool) -> Floats:
    """First axis (N, 2) of the samples' frame."""
    mechanism = linkage.mechanism
    if not is_of_foot or mechanism.toe is None:
        up = upwards(mechanism)
        return np.tile([up[1], -up[0]], (POINTS, 1))
    angle = one_cycle(linkage, POINTS, 1.0).q[:, body_names(mechanism).index(mechanism.toe[0]), 2]
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


@kernel
def in_mechanism(axis, row, fx, fy):
    """A force of a sample at a row of the tables, along the axes of the mechanism."""
    i = math.floor(row + 0.5) % axis.shape[0]
    return axis[i, 0] * fx - axis[i, 1] * fy, axis[i, 1] * fx + axis[i, 0] * fy


@kernel
def learn(load, before, row, force_before, force):
    """Learn the mean force of the rows between two rows, from the forces (2,) there."""
    n, step = load.learned.shape[0], 1 if row >= before else -1
    first = math.floor(before) + 1 if step > 0 else math.ceil(before) - 1
    last = math.floor(row) if step > 0 else math.ceil(row)
    for k in range(min(step * (last - first) + 1, n)):
        at = first + step * k
        w, i = (at - before) / (row - before), at % n
        load.learned[i] = min(load.learned[i] + 1.0, _LEARNED)
        for c in range(2):
            now = force_before[c] + w * (force[c] - force_before[c])
            load.mean[i, c] += (now - load.mean[i, c]) / load.learned[i]


# A load of a given shape and size.


# Deviation of measured stances from the template, RMS over the peak: 0.055 to 0.119 of the vertical force,
# and 0.034 to 0.062 of the fore-aft one (docs/appendix/benchmarks.md).
_VERTICAL, _FORE_AFT = 0.09, 0.05


class FootLoad:
    """The leg's tables under a load at the toe: of a shape and a size, or measured.

    Parameters
    ----------
    linkage : Linkage
    contacts : ContactArrays
    is_measured, is_of_foot : bool
        True if a measured force acts, and whether its axes are fixed to the foot.

    Attributes
    ----------
    tables : ClearanceTables
        Tables for the present load, changed in place.
    signature : (N + 1,) array
        Drive torque per upward load [N m/N], zeros for a mechanism without a toe.
    rows : LoadRows
        The measured force.
    acting_n : (N, 2) array
        Measured or estimated force that acts, along the axes of the mechanism [N].
    toe_m : (N, 2) array
        Motion of the toe per radian of the crank [m]; zeros for a mechanism without a toe.
    """

    def __init__(
        self,
        linkage: Linkage,
        contacts: ContactArrays,
        is_measured: bool = False,
        is_of_foot: bool = False,
    ) -> None:
        self.tables, self._loaded = loaded_tables(linkage, contacts)
        self.signature, self.acting_n = np.zeros(POINTS + 1), np.zeros((POINTS, 2))
        self._contacts, self._load = contacts, 0.0
        self._known, self._is_of_foot = np.zeros((0, 2)), is_of_foot
        rows = POINTS if is_measured and linkage.mechanism.toe else 0
        axis, up = _axis(linkage, is_of_foot), upwards(linkage.mechanism)
        self.rows = LoadRows(axis, up, np.zeros((rows, 2)), np.zeros(rows))
        self._set_up(linkage)

    def rebuild(self, linkage: Linkage, known: Floats) -> None:
        """Set the tables, in place, for a leg with other masses or lengths under the same load.

        Parameters
        ----------
        linkage : Linkage
            Without the load.
        known : (PHASES, 2) array
            Force that gives the shape of the load [N], such as an identified one; (0, 2) for a person's
            stance.
        """
        self._known, load, measured = known, self._load, self.acting_n
        _, self._loaded = loaded_tables(linkage, self._contacts, self.tables)
        self.rows.axis[:] = _axis(linkage, self._is_of_foot)
        self._load, self.acting_n = 0.0, np.zeros((POINTS, 2))
        self._set_up(linkage)
        if len(self.rows.mean):
            self._put(measured)
        self.set(load)

    def _set_up(self, linkage: Linkage) -> None:
        """Compute the motion of the toe, and the force and the torque of a load of 1 N."""
        self.toe_m = np.zeros((POINTS, 2))
        if linkage.mechanism.toe:
            self.toe_m = point_motion(one_cycle(linkage, POINTS, 1.0), linkage, *linkage.mechanism.toe)[1]
        known = self._known
        known = known / (known @ self.rows.up).max() if known.size else stance_shape(linkage)
        self._force, signature = known, -(at_points(known) * self.toe_m).sum(axis=1)  # by virtual work
        self.signature[:] = np.append(signature, signature[0])

    def _put(self, force_n: Floats) -> None:
        self.acting_n = force_n
        put_force(self._loaded, force_n)

    def take_mean(self) -> None:
        """Let the mean of the measured force act, smoothed; between steps the ground does not push."""
        if not len(self.rows.mean):
            return
        window = np.exp(-0.5 * (TURN * _SMOOTH * np.arange(POINTS // 2 + 1)) ** 2)
        force = np.fft.irfft(np.fft.rfft(self.rows.mean, axis=0) * window[:, None], POINTS, axis=0)
        up = force @ self.rows.up
        if up.max() > 0.0:
            stands = np.clip((up / up.max() - _NONE) / (_SURE - _NONE), 0.0, 1.0)
        else:
            stands = np.zeros(POINTS)
        self._put(force * (stands**2 * (3.0 - 2.0 * stands))[:, None])

    @property
    def peak_n(self) -> float:
        """Largest vertical part over a gait cycle of the load that acts now [N]."""
        return float((self.acting_n @ self.rows.up).max()) if len(self.rows.mean) else self._load

    def set(self, load: float) -> None:
        """Set the tables to a load [N], positive upwards."""
        if load != self._load:
            self._load = load
            self._put(load * at_points(self._force))


def stance_shape(linkage: Linkage) -> Floats:
    """Force of a person's stance on the toe (PHASES, 2) over its peak; zeros without a toe that walks."""
    try:
        return nominal_stance(linkage).force()
    except ConfigError:
        return np.zeros((PHASES, 2))


def load_shape(linkage: Linkage) -> Floats:
    """Force on the toe (PHASES, 2) in proportion to its depth below its mean height; zeros without a toe."""
    mechanism = linkage.mechanism
    if mechanism.toe is None:
        return np.zeros((PHASES, 2))
    up = upwards(mechanism)
    height = point_motion(one_cycle(linkage, PHASES, 1.0), linkage, *mechanism.toe)[0] @ up
    depth = np.maximum(0.0, height.mean() - height)
    return np.outer(depth / (depth.max() or 1.0), up)


def shape_torque(linkage: Linkage) -> float:
    """RMS difference of steps from the template, in drive torque per newton of the peak [N m/N]."""
    toe = linkage.mechanism.toe
    if toe is None or not stance_shape(linkage).any():
        return 0.0
    stance = nominal_stance(linkage)
    _, velocity, _ = point_motion(one_cycle(linkage, PHASES, 1.0), linkage, *toe)
    other = _VERTICAL * (velocity @ stance.up), _FORE_AFT * (velocity @ stance.back)
    in_stance = stance.fractions() <= 1.0
    return float(np.sqrt(np.mean(np.where(in_stance, np.hypot(*other), 0.0) ** 2)))


def load_signatures(linkage: Linkage, forces: Sequence[Floats]) -> list[Floats]:
    """Drive torques (POINTS,) [N m/N] for some forces (PHASES, 2) on the toe; zeros without a toe."""
    toe = linkage.mechanism.toe
    if toe is None:
        return [np.zeros(POINTS)] * len(forces)
    _, velocity, _ = point_motion(one_cycle(linkage, POINTS, 1.0), linkage, *toe)
    return [-(at_points(force) * velocity).sum(axis=1) for force in forces]


def at_points(force: Floats) -> Floats:
    """A force (PHASES, 2) at the points of the leg's tables (POINTS, 2)."""
    phases = np.arange(POINTS) / POINTS * len(force)
    place = np.arange(len(force))
    return np.stack([np.interp(phases, place, one, period=len(force)) for one in force.T], axis=1)


def torque_size(linkage: Linkage, speed: float) -> float:
    """RMS of the ideal linkage's drive torque [N m] over a turn, at a crank speed [rad/s]."""
    return float(np.sqrt(np.mean(one_cycle(linkage, POINTS, speed).drive_torque ** 2)))
