"""What a simulation found: the object that ``simulate --json`` writes."""

from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.dynamics.run.protocol import Sample, Setup
from leg_wear_monitor.dynamics.run.run_statistics import (
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
    percentile,
    signed_percentile,
)
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.wear.surfaces import BUSHING, JOURNAL, Surfaces, wear_zone

JsonObject = dict[str, Any]


@attrs.frozen(eq=False)
class SimulationResult:
    """Statistics of the counted cycles; units are in the names, SI throughout.

    Attributes
    ----------
    mechanism, model : str
    speed_rpm, cycles, simulated_s : float
        ``cycles`` are those counted, ``simulated_s`` includes those skipped.
    drive_torque_nm, energy_j : dict
    toe : dict or None
        None without a point called ``toe`` or without an ideal motion to compare with.
    joints, impacts : dict of str
    trace : dict or None
    clearance_joints : tuple of str
    surfaces : Surfaces or None
        Worn surfaces at the end, in the order of ``clearance_joints``.
    """

    mechanism: str
    model: str
    speed_rpm: float
    cycles: float
    simulated_s: float
    drive_torque_nm: dict[str, float]
    energy_j: dict[str, float] | None
    toe: dict[str, float] | None
    joints: dict[str, JsonObject]
    impacts: dict[str, list[dict[str, float | None]]]
    trace: JsonObject | None
    clearance_joints: tuple[str, ...] = ()
    surfaces: Surfaces | None = None

    def to_dict(self) -> JsonObject:
        """Plain object for JSON."""
        fields = (
            "mechanism",
            "model",
            "speed_rpm",
            "cycles",
            "simulated_s",
            "drive_torque_nm",
            "energy_j",
            "toe",
        )
        result = {name: getattr(self, name) for name in fields}
        result["joints"], result["impacts"] = self.joints, self.impacts
        if self.trace is not None:
            result["trace"] = self.trace
        return result


def drive_torque(statistics: RunStatistics) -> dict[str, float]:
    """Mean, RMS, range and 99th percentile of the drive torque, its largest magnitude, and its largest error.

    ``p99`` is of the signed torque, as ``min`` and ``max`` are; ``max_error`` is against the ideal linkage.
    """
    mean, square = statistics.drive_integral[[TORQUE, TORQUE_SQUARED]] / statistics.time[0]
    return {
        "mean": float(mean),
        "rms": float(np.sqrt(square)),
        "min": float(statistics.drive_range[0]),
        "max": float(statistics.drive_range[1]),
        "p99": signed_percentile(statistics.torque_time, 0.99),
        "max_abs": float(np.abs(statistics.drive_range).max()),
        "max_error": float(statistics.response[3]),
    }


def toe_errors(statistics: RunStatistics) -> dict[str, float]:
    """Largest deviations of the toe from the ideal linkage at the same crank angle."""
    names = ("max_position_error_m", "max_velocity_error_mps", "max_acceleration_error_mps2")
    return {name: float(value) for name, value in zip(names, statistics.response, strict=False)}


def energy_balance(statistics: RunStatistics, stored_before: float, stored_after: float) -> dict[str, float]:
    """Work from outside, change of stored energy, losses, and what does not add up [J].

    ``wear_loss`` is what contacts had stored in walls that wore away: next to nothing at the pace of real
    wear, a thousandth of the losses where clearances double in some thousand cycles.
    """
    work = float(statistics.drive_integral[POWER])
    friction, contact = (float(statistics.integral[:, i].sum()) for i in (FRICTION, DISSIPATION))
    wear = float(statistics.worn_energy[0])
    stored = stored_after - stored_before
    return {
        "work_in": work,
        "stored": stored,
        "friction_loss": friction,
        "contact_loss": contact,
        "wear_loss": wear,
        "residual": work - stored - friction - contact - wear,
    }


def joint_statistics(
    setup: Setup, statistics: RunStatistics, worn: Floats, cycles: float
) -> dict[str, JsonObject]:
    """Forces in every joint, contact and wear of the loose ones; worn (k, 2, N) while counted [m]."""
    figures = {}
    for joint, name in enumerate(setup.linkage.mechanism.joints):
        mean, square, contact = (
            statistics.integral[joint, [FORCE, FORCE_SQUARED, CONTACT]] / statistics.time[0]
        )
        figure: JsonObject = {
            "mean_force_n": float(mean),
            "rms_force_n": float(np.sqrt(square)),
            "p99_force_n": percentile(statistics.force_time[joint], 0.99),
            "max_force_n": float(statistics.peak[joint]),
        }
        if name in setup.clearance_joints:
            k = setup.clearance_joints.index(name)
            figure["contact_fraction"] = float(contact)
            figure["friction_work_j_per_cycle"] = float(statistics.integral[joint, FRICTION] / cycles)
            figure["archard_integral_j_per_cycle"] = float(statistics.integral[joint, ARCHARD] / cycles)
            figure |= _wear_statistics(setup, k, worn[k], cycles)
        figures[name] = figure
    return figures


def _wear_statistics(setup: Setup, k: int, worn: Floats, cycles: float) -> JsonObject:
    zone = wear_zone(worn[BUSHING])
    opened = setup.surfaces.depth[k].sum(axis=0) if setup.surfaces.feeds_back else np.zeros(1)
    clearance = float(setup.contacts.clearance[k])
    return {
        "wear_depth_m_per_cycle": {
            "bushing_max": float(worn[BUSHING].max() / cycles),
            "bushing_mean": float(worn[BUSHING].mean() / cycles),
            "journal_max": float(worn[JOURNAL].max() / cycles),
            "journal_mean": float(worn[JOURNAL].mean() / cycles),
        },
        "wear_zone_deg": None if zone is None else list(zone),
        "clearance_m": {"mean": clearance + float(opened.mean()), "max": clearance + float(opened.max())},
    }


def impact_lists(setup: Setup, statistics: RunStatistics) -> dict[str, list[dict[str, float | None]]]:
    """The first thousand impacts of each clearance joint; one that still lasts has no end."""
    names = list(setup.linkage.mechanism.joints)
    result = {}
    for name in setup.clearance_joints:
        joint = names.index(name)
        rows = statistics.impact[joint, : min(IMPACTS, int(statistics.impacts[joint]))]
        result[name] = [
            {
                "begin_s": float(begin),
                "speed_mps": float(speed),
                "end_s": None if np.isnan(end) else float(end),
                "peak_n": float(peak),
            }
            for begin, speed, end, peak in rows
        ]
    return result


def trace_columns(setup: Setup, samples: list[Sample]) -> JsonObject:
    """Samples as lists; the crank angle counts on from its value in the first turn."""
    angles = np.array([sample.crank_angle for sample in samples])
    forces = np.array([sample.force for sample in samples])
    turns = TURN * np.floor(angles[0] / TURN + 1.0e-9)
    trace: JsonObject = {"crank_angle_rad": (angles - turns).tolist()}
    if samples[0].toe is not None:
        toe = np.array([sample.toe for sample in samples])
        trace |= {"toe_x_m": toe[:, 0].tolist(), "toe_y_m": toe[:, 1].tolist()}
    trace["drive_torque_nm"] = [sample.drive_torque for sample in samples]
    trace["force_n"] = {name: forces[:, i].tolist() for i, name in enumerate(setup.linkage.mechanism.joints)}
    return trace
