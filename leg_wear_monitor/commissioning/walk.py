"""A recording as the monitor sees it with the proposed parameters: its faults, and its torque residual."""

import math
from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.commissioning.result import CommissioningItem
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.alarms import WARN_FRACTION
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.settings import LedgerFile, MonitorConfig
from leg_wear_monitor.monitor.input_health import INPUT_RULES
from leg_wear_monitor.monitor.reports import CycleReport
from leg_wear_monitor.monitor.wear_monitor import WearMonitor
from leg_wear_monitor.recordings.bag import Recordable
from leg_wear_monitor.recordings.reader import Recording
from leg_wear_monitor.twin.reference import CrankProfile, cycle_profile, mean_profile
from leg_wear_monitor.twin.sample import GAIT_SAMPLE, Samples, newest, of_crank, within

LIMIT = "limits.torque_mismatch"
LEAST_CYCLES = 8  # gait cycles for a reference: their mean shows how the crank turns

_LEAST_ANGLES = 40  # crank samples in a gait cycle, for its profile
_LEAST_COMPARED = 10  # gait cycles for a limit
# scatters of a cycle's torque residual from its mean to a warning: by chance less than once in 1e6
_SIGMAS = 5.3


@attrs.frozen(eq=False)
class Walk:
    """Gait cycles of a healthy leg.

    Attributes
    ----------
    mechanism : Mechanism
        With the parameters applied.
    config : MonitorConfig
    mismatch : (n,) array
        Torque residual in each gait cycle that the monitor compared.
    profiles : tuple of CrankProfile
        Motion of the crank in each gait cycle at the commanded cadence.
    faults : tuple of str
        Faults of the input that the monitor reports, with their remedies.
    """

    mechanism: Mechanism
    config: MonitorConfig
    mismatch: Floats
    profiles: tuple[CrankProfile, ...]
    faults: tuple[str, ...]

    @property
    def profile(self) -> CrankProfile | None:
        """Mean motion of the crank; None if there are too few gait cycles."""
        return mean_profile(self.profiles) if len(self.profiles) >= LEAST_CYCLES else None


def walk_of(
    recordings: Sequence[Recordable],
    config: MonitorConfig,
    joint_states: str | None,
    drive_torque: str | None,
) -> Walk:
    """Results of the monitor for recordings of a healthy leg.

    Parameters
    ----------
    recordings : sequence
        Recordings of the leg with the crank's zero of the parameters.
    config : MonitorConfig
        Proposed parameters.
    joint_states, drive_torque : str or None
        Topics, as asked for.

    Raises
    ------
    RecordingError
        If their topics cannot be told apart.
    """
    quiet = attrs.evolve(config.diagnosis, enabled=False)
    config = attrs.evolve(config, diagnosis=quiet, ledger=LedgerFile())
    mechanism = load_mechanism(config.mechanism)
    monitor = WearMonitor(mechanism, config)
    crank: Samples = np.zeros(0, GAIT_SAMPLE)
    codes, faults = {rule.code for rule in INPUT_RULES}, dict[str, str]()
    mismatch: list[float] = []
    profiles: list[CrankProfile] = []
    with Recording(recordings, config, joint_states=joint_states, drive_torque=drive_torque) as recording:
        for block in recording.blocks():
            crank = newest(np.concatenate([crank, of_crank(block.samples)]), 0)
            reports = monitor.update(block.samples)
            reported = (each.verdict for each in reports.verdicts)
            faults |= {one.fault_code: f"{one.why}: {one.do}" for one in reported if one.fault_code in codes}
            for cycle in reports.cycles:
                mismatch.append(cycle.torque_mismatch)
                if config.cadence.allows(cycle.cadence_rpm) and not cycle.bridged_s:
                    profiles += _profile(within(crank, cycle.begin_ns, cycle.stamp_ns), cycle)
                crank = newest(crank, cycle.stamp_ns)
    compared = np.array(mismatch)[np.isfinite(mismatch)]
    return Walk(fitted(mechanism, config), config, compared, tuple(profiles), tuple(faults.values()))


def _profile(crank: Samples, cycle: CycleReport) -> list[CrankProfile]:
    """Motion of the crank in a gait cycle; none if it has too few samples."""
    if len(crank) < _LEAST_ANGLES:
        return []
    since_s = np.asarray(1.0e-9 * (crank["stamp_ns"] - cycle.begin_ns), np.float64)
    turned = np.asarray(np.unwrap(crank["crank_angle_rad"], period=TURN), np.float64)
    return [cycle_profile(since_s, turned, 1.0e-9 * (cycle.stamp_ns - cycle.begin_ns))]


def mismatch_item(walk: Walk) -> CommissioningItem | None:
    """Torque residual limit from a healthy leg; None with too few gait cycles.

    A given limit stays if it is high enough.
    """
    found = walk.mismatch
    if len(found) < _LEAST_COMPARED:
        return None
    mean, scatter = float(found.mean()), float(found.std(ddof=1))
    least = (mean + _SIGMAS * scatter) / WARN_FRACTION
    given = walk.config.limits.torque_mismatch
    return CommissioningItem(
        name=LIMIT,
        value=given if least <= given else math.ceil(100.0 * least) / 100.0,
        sigma=scatter,
        remark=f"{mean:.2g} in {len(found)} gait cycles of this leg",
    )
