"""Interface between a simulation and a formulation: setup, status codes, samples."""

from typing import NamedTuple, Protocol

import attrs

from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.run.run_statistics import RunStatistics
from leg_wear_monitor.errors import SimulationError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import Linkage
from leg_wear_monitor.wear.surfaces import Surfaces

DONE, STEP_TOO_SMALL, SINGULAR, PUSHED_THROUGH, INVALID_DRIVE = 0, 1, 2, 3, 4

_REASONS = {
    STEP_TOO_SMALL: (
        "the integration step became too small; check for a mass, inertia or stiffness far out of range"
    ),
    SINGULAR: "the closures became singular; check for a dead point, or try smaller clearances",
    PUSHED_THROUGH: (
        "the journal was pushed through a tenth of the bushing's radius; "
        "try a lower speed, a smaller clearance or a higher stiffness"
    ),
    INVALID_DRIVE: "the crank's motion is not finite or far too fast; check its speed and acceleration",
}


@attrs.frozen(eq=False)
class Setup:
    """A leg prepared for a run.

    Attributes
    ----------
    linkage : Linkage
    clearance_joints : tuple of str
        Names of the clearance joints, in the order of ``contacts``.
    contacts : ContactArrays
    films : (k, 2) array
        Viscosity [Pa s] and roughness [m] of the clearance joints' films; 0 for a dry joint.
    surfaces : Surfaces
        Worn surfaces; the run changes them.
    speed : float
        Initial crank speed [rad/s].
    """

    linkage: Linkage
    clearance_joints: tuple[str, ...]
    contacts: ContactArrays
    films: Floats
    surfaces: Surfaces
    speed: float


class Sample(NamedTuple):
    """One instant: crank angle [rad], toe (2,) [m] or None, drive torque [N m], joint forces (j,) [N]."""

    crank_angle: float
    toe: Floats | None
    drive_torque: float
    force: Floats


class Run(Protocol):
    """A run of a leg in some formulation."""

    @property
    def time(self) -> float:
        """Time reached [s]."""

    @property
    def stored_energy(self) -> float:
        """Kinetic energy plus the potential energy of gravity, springs and contacts [J]."""

    def advance(self, t_end: float, statistics: RunStatistics) -> None:
        """Advance to a time [s] and add to run statistics; raises SimulationError if the motion diverges."""

    def sample(self) -> Sample:
        """The present state of the leg."""


def stop(setup: Setup, status: int, k: int, time: float) -> SimulationError:
    """Error for a run that stopped with a status, in clearance joint k (-1 if none), at a time [s]."""
    where = f"joint {setup.clearance_joints[k]} " if k >= 0 else ""
    return SimulationError(
        f"{setup.linkage.mechanism.source}: {where}at t = {time:.6g} s: {_REASONS[status]}"
    )
