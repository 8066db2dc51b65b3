"""Computation of a simulation's result from run statistics."""

import math
from collections.abc import Iterator
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.contact.geometry import contact_doubt, half_angle_under_load, is_winkler_form
from leg_wear_monitor.dynamics.joint import DELTA, EX, EY, F_N, F_T, VX, VY
from leg_wear_monitor.dynamics.result import (
    ClearanceResult,
    EnergyBalance,
    Impact,
    JointResult,
    JointTrace,
    SimulationResult,
    ToeResult,
    TorqueResult,
    Trace,
    WearDepth,
)
from leg_wear_monitor.dynamics.run import (
    ARCHARD,
    CONTACT,
    DISSIPATION,
    FORCE,
    FORCE_SQUARED,
    FRICTION,
    IMPACTS,
    POWER,
    TORQUE,
    TORQUE_SQUARED,
    RunStatistics,
    Sample,
    Setup,
    percentile,
    signed_percentile,
)
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.materials import regime_of
from leg_wear_monitor.mechanism.position import TURN, ideal_motion, point_motion
from leg_wear_monitor.mechanism.spec import SpeedDrive
from leg_wear_monitor.wear import BUSHING, JOURNAL, wear_zone


def drive_torque(statistics: RunStatistics) -> TorqueResult:
    """Drive torque over the evaluated time."""
    mean, square = statistics.drive_integral[[TORQUE, TORQUE_SQUARED]] / statistics.time[0]
    return TorqueResult(
        mean=float(mean),
        rms=float(np.sqrt(square)),
        min=float(statistics.drive_range[0]),
        max=float(statistics.drive_range[1]),
        p99=min(signed_percentile(statistics.torque_time, 0.99), float(statistics.drive_range[1])),
        max_abs=float(np.abs(statistics.drive_range).max()),
        max_error=float(statistics.response[3]),
    )


def toe_errors(statistics: RunStatistics) -> ToeResult:
    """Largest deviations of the toe from the ideal linkage."""
    return ToeResult(*(float(value) for value in statistics.response[:3]))


def energy_balance(statistics: RunStatistics, stored_before: float, stored_after: float) -> EnergyBalance:
    """Energy balance over the evaluated time, from the stored energy [J] at its start and end."""
    work = float(statistics.drive_integral[POWER])
    friction, contact = (float(statistics.integral[:, i].sum()) for i in (FRICTION, DISSIPATION))
    wear = float(statistics.worn_energy[0])
    stored = stored_after - stored_before
    return EnergyBalance(
        work_in=work,
        stored=stored,
        friction_loss=friction,
        contact_loss=contact,
        wear_loss=wear,
        residual=work - stored - friction - contact - wear,
    )


# Residual over the losses, and over its standard error, above which the energy does not close: five clearance
# joints of the default leg have 0.3 % at 0.6 mm, 1.3 % at 2 mm and 6 % at 3 mm, with wear off.
_MOST_RESIDUAL, _SURE = 0.02, 3.0
# smallest losses, as a fraction of RMS torque times crank travel. Runs with hardly any losses (0.6 rpm, or
# elastic contacts without friction) have residuals of up to 9e-5 of it and correct forces; at 3 mm the
# residual is 9e-4
_LEAST_LOSS = 0.005


def open_balance(result: SimulationResult) -> str | None:
    """Fault of a result in clearance coordinates with an energy balance that does not close; None if it does.

    Also None below two whole cycles, which have no standard error.
    """
    energy, errors = result.energy_j, result.standard_error
    if energy is None or errors is None or result.model != "clearance":
        return None
    lost = abs(energy.friction_loss + energy.contact_loss + energy.wear_loss)
    to_and_fro = TURN * result.cycles * result.drive_torque_nm.rms
    most = max(_MOST_RESIDUAL * max(lost, _LEAST_LOSS * to_and_fro), _SURE * errors["energy_j.residual"])
    if abs(energy.residual) <= most:
        return None
    return (
        f"the energy balance does not close: its residual is {energy.residual:.3g} "
        f"J, its losses are {lost:.3g} "
        "J. Forces and wear may be wrong. Use --model full"
    )


_ADDITIVE = ("time", "integral", "drive_integral", "force_time", "torque_time", "worn_energy")
_ONE_SAMPLE = ("max_force_n", "clearance_m", "contact_half_angle_deg", "min", "max", "max_abs", "max_error")


class CycleScatter:
    """Scatter of the values between gait cycles (Welford's sums), from run statistics that go on.

    Parameters
    ----------
    setup : Setup
    statistics : RunStatistics
        Statistics of the evaluated time, empty.
    stored : float, J
        Stored energy now.
    """

    def __init__(self, setup: Setup, statistics: RunStatistics, stored: float) -> None:
        self._setup, self._count = setup, 0
        self._paths: tuple[str, ...] = ()
        self._mean = self._squares = np.zeros(0)
        self._before = self._now(statistics, stored)

    def end_cycle(self, statistics: RunStatistics, stored: float) -> None:
        """Add the gait cycle since the last call."""
        before, self._before = self._before, self._now(statistics, stored)
        names = {name: self._before[name] - before[name] for name in _ADDITIVE}
        cycle, worn = statistics._replace(**names), self._before["depth"] - before["depth"]
        parts = {
            "drive_torque_nm": drive_torque(cycle),
            "energy_j": energy_balance(cycle, before["stored"], stored),
            "joints": _mean_loads(self._setup, cycle, worn, 1.0),
        }
        values = {path: value for name, part in parts.items() for path, value in _numbers(name, part)}
        now = np.concatenate([list(values.values()), worn.ravel()])
        if self._count == 0:
            self._paths = tuple(values)
            self._mean, self._squares = np.zeros_like(now), np.zeros_like(now)
        self._count += 1
        off = now - self._mean
        self._mean = self._mean + off / self._count
        self._squares = self._squares + off * (now - self._mean)

    def standard_errors(self, cycles: float) -> dict[str, float] | None:
        """Standard errors of the values over a number of cycles, by path; None after fewer than two cycles.

        Energies are sums over the cycles; all other values are means. The greatest depth belongs to one
        sector.
        """
        if self._count < 2:
            return None
        sigma = np.sqrt(self._squares / (self._count - 1.0))
        number = len(self._paths)
        errors = {
            path: float(each * (cycles if path.startswith("energy_j") else 1.0) / math.sqrt(cycles))
            for path, each in zip(self._paths, sigma[:number], strict=True)
        }
        shape = self._before["depth"].shape
        worn, scatter = self._mean[number:].reshape(shape), sigma[number:].reshape(shape)
        for k, name in enumerate(self._setup.clearance_joints):
            for side, surface in (("bushing", BUSHING), ("journal", JOURNAL)):
                deepest = scatter[k, surface, worn[k, surface].argmax()]
                path = f"joints.{name}.wear_depth_m_per_cycle.{side}_max"
                errors[path] = float(deepest / math.sqrt(cycles))
        return errors

    def _now(self, statistics: RunStatistics, stored: float) -> dict[str, Any]:
        sums = {name: getattr(statistics, name).copy() for name in _ADDITIVE}
        return {**sums, "depth": self._setup.surfaces.depth.copy(), "stored": stored}


def _numbers(path: str, part: Any) -> Iterator[tuple[str, float]]:
    """Numbers in a part of a result that add up over cycles, with their paths."""
    if isinstance(part, float) and path.rpartition(".")[2] not in _ONE_SAMPLE:
        yield path, part
    elif isinstance(part, dict):
        for name, value in part.items():
            yield from _numbers(f"{path}.{name}", value)
    elif attrs.has(type(part)):
        yield from _numbers(path, attrs.asdict(part, recurse=False))


def joint_statistics(
    setup: Setup, statistics: RunStatistics, worn: Floats, cycles: float
) -> dict[str, JointResult]:
    """Results of all joints by name; ``worn`` (k, 2, N) [m] is the wear depth of the evaluated cycles."""
    found = _mean_loads(setup, statistics, worn, cycles)
    for k, name in enumerate(setup.clearance_joints):
        psi, doubt = _contact(setup, k, found[name].p99_force_n)
        found[name] = attrs.evolve(
            found[name],
            wear_zone_deg=_within_turn(wear_zone(worn[k, BUSHING])),
            clearance_m=_clearance(setup, k),
            holds_for=regime_of(setup.linkage.mechanism.clearances[name]),
            contact_half_angle_deg=math.degrees(psi),
            outside_contact_law=doubt,
        )
    return found


def _within_turn(zone: tuple[float, float] | None) -> tuple[float, float] | None:
    """The zone with both angles from 0 to 360 [deg]; ``to`` is the smaller angle if the zone crosses 0."""
    if zone is None or zone[1] <= 360.0:
        return zone
    return zone[0], zone[1] - 360.0


def _mean_loads(
    setup: Setup, statistics: RunStatistics, worn: Floats, cycles: float
) -> dict[str, JointResult]:
    """Forces of all joints by name; of a clearance joint also contact, work, wear and pressure."""
    found = {}
    for joint, name in enumerate(setup.linkage.mechanism.joints):
        integral = statistics.integral[joint]
        mean, square, contact = integral[[FORCE, FORCE_SQUARED, CONTACT]] / statistics.time[0]
        forces = JointResult(
            mean_force_n=float(mean),
            rms_force_n=float(np.sqrt(square)),
            # a percentile is exact to the width of its bin, which may reach beyond the largest force
            p99_force_n=min(percentile(statistics.force_time[joint], 0.99), float(statistics.peak[joint])),
            max_force_n=float(statistics.peak[joint]),
        )
        if name not in setup.clearance_joints:
            found[name] = forces
            continue
        k, rubbing_w = setup.clearance_joints.index(name), float(integral[ARCHARD] / statistics.time[0])
        load = setup.bushings[k].load(forces.mean_force_n, forces.p99_force_n, rubbing_w)
        found[name] = attrs.evolve(
            forces,
            contact_fraction=float(contact),
            friction_work_j_per_cycle=float(integral[FRICTION] / cycles),
            archard_integral_j_per_cycle=float(integral[ARCHARD] / cycles),
            wear_depth_m_per_cycle=WearDepth(
                bushing_max=float(worn[k, BUSHING].max() / cycles),
                bushing_mean=float(worn[k, BUSHING].mean() / cycles),
                journal_max=float(worn[k, JOURNAL].max() / cycles),
                journal_mean=float(worn[k, JOURNAL].mean() / cycles),
            ),
            **{name: getattr(load, name) for name in _OF_A_LOAD},
        )
    return found


_OF_A_LOAD = (
    "mean_pressure_pa", "p99_pressure_pa", "mean_sliding_speed_mps", "mean_pressure_speed_pa_mps",
    "outside_limits",
)  # fmt: skip


def _contact(setup: Setup, k: int, force_n: float) -> tuple[float, str | None]:
    """Half angle [rad] of clearance joint k's contact arc under a force, and why its law does not hold."""
    contacts = setup.contacts
    modulus, width, clearance, radius = (
        float(values[k])
        for values in (contacts.modulus, contacts.width, contacts.clearance, contacts.bushing_radius)
    )
    psi = half_angle_under_load(force_n, modulus, width, clearance)
    return psi, contact_doubt(psi, force_n, radius, is_winkler_form(int(contacts.normal_form[k])))


def _clearance(setup: Setup, k: int) -> ClearanceResult:
    opened = setup.surfaces.depth[k].sum(axis=0) if setup.surfaces.feeds_back else np.zeros(1)
    clearance = float(setup.contacts.clearance[k])
    return ClearanceResult(clearance + float(opened.mean()), clearance + float(opened.max()))


def first_impacts(setup: Setup, statistics: RunStatistics) -> dict[str, tuple[Impact, ...]]:
    """The first thousand impacts of each clearance joint."""
    names = list(setup.linkage.mechanism.joints)
    result = {}
    for name in setup.clearance_joints:
        joint = names.index(name)
        rows = statistics.impact[joint, : min(IMPACTS, int(statistics.impacts[joint]))]
        result[name] = tuple(
            Impact(float(begin), float(speed), None if np.isnan(end) else float(end), float(peak))
            for begin, speed, end, peak in rows
        )
    return result


def trace_of(setup: Setup, samples: list[Sample], model: str) -> Trace:
    """Trace from samples; the crank angle is continuous and starts in [0, 2 pi)."""
    linkage, angles = setup.linkage, np.array([sample.crank_angle for sample in samples])
    parts: dict[str, Any] = {}
    if linkage.mechanism.toe is not None:
        parts = toe_parts(np.array([sample.toe for sample in samples]))
        if isinstance(linkage.mechanism.drive, SpeedDrive):
            # equal crank angles of all cycles have the same ideal motion
            turns, each = np.unique(np.round(angles / TURN % 1.0, 12), return_inverse=True)
            motion = ideal_motion(linkage, TURN * turns, setup.speed)
            ideal = np.stack(point_motion(motion, linkage, *linkage.mechanism.toe), axis=1)[each]
            toe = np.array([sample.toe for sample in samples])
            error = toe if model == "clearance" else toe - ideal
            parts = toe_parts(error + ideal, error)
    forces = np.array([sample.force for sample in samples])
    contacts = np.array([sample.contact for sample in samples])
    touching = np.array([sample.touching for sample in samples])
    worn = np.array([sample.worn for sample in samples])
    return Trace(
        crank_angle_rad=angles - TURN * np.floor(angles[0] / TURN + 1.0e-9),
        drive_torque_nm=np.array([sample.drive_torque for sample in samples]),
        force_n={name: forces[:, i] for i, name in enumerate(linkage.mechanism.joints)},
        joints={
            name: JointTrace(
                eccentricity_m=contacts[:, [EX, EY], k],
                eccentricity_rate_mps=contacts[:, [VX, VY], k],
                penetration_m=contacts[:, DELTA, k],
                in_contact=touching[:, k],
                normal_force_n=contacts[:, F_N, k],
                tangential_force_n=contacts[:, F_T, k],
                worn_depth_m=worn[:, k],
            )
            for k, name in enumerate(setup.clearance_joints)
        },
        **parts,
    )


def toe_parts(toe: Floats, error: Floats | None = None) -> dict[str, Floats]:
    """Fields of a trace from the toe's motion (n, 3, 2), and from its deviation from the ideal linkage."""
    found = {"toe_x_m": toe[:, 0, 0], "toe_y_m": toe[:, 0, 1]}
    found |= {"toe_velocity_mps": toe[:, 1], "toe_acceleration_mps2": toe[:, 2]}
    if error is None:
        return found
    names = ("toe_error_m", "toe_error_mps", "toe_error_mps2")
    return found | {name: error[:, i] for i, name in enumerate(names)}
