"""A recording as the monitor sees it with the proposed parameters: gait cycles with their torques."""

from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.bags.bag import Recordable
from leg_wear_monitor.bags.reader import Recording
from leg_wear_monitor.estimate.commissioned_torque import CommissionedTorque
from leg_wear_monitor.estimate.signature import TorqueSensor
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.position import build_linkage
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.settings import LedgerFile, MonitorConfig
from leg_wear_monitor.monitor.diagnosis.diagnosis import NotUsed
from leg_wear_monitor.monitor.diagnosis.signed_cycle import find_sensor, signed_cycle
from leg_wear_monitor.monitor.diagnosis.state import SignedCycle, TorqueState
from leg_wear_monitor.monitor.reports import CycleReport
from leg_wear_monitor.monitor.wear_monitor import WearMonitor
from leg_wear_monitor.twin.follower.load import torque_size
from leg_wear_monitor.twin.reference.crank_profile import CrankProfile, mean_profile

LEAST_CYCLES = 8  # without which the scatter of a gait cycle is not known
_SETTLING = 1  # gait cycles at the start of a walk, after which the joints move as in all others


@attrs.frozen(eq=False)
class Walk:
    """Gait cycles of a healthy leg.

    Attributes
    ----------
    mechanism : Mechanism
        With the parameters applied.
    config : MonitorConfig
    mismatch : (n,) array
        Of the drive torque in each gait cycle, as the monitor finds it.
    cycles : tuple of SignedCycle
        Those at the commanded cadence whose torque has a signature.
    sensor : TorqueSensor or None
        How the torque was measured, without its noise; None without torques.
    """

    mechanism: Mechanism
    config: MonitorConfig
    mismatch: Floats
    cycles: tuple[SignedCycle, ...]
    sensor: TorqueSensor | None

    @property
    def profile(self) -> CrankProfile:
        """Mean motion of the crank in the gait cycles, of which there is at least one."""
        return mean_profile([cycle.profile for cycle in self.cycles])

    @property
    def new_m(self) -> Floats:
        """Clearances (k,) of a new leg [m]."""
        joints = self.mechanism.clearance_joints
        return np.array([self.mechanism.clearances[joint].radial_clearance for joint in joints])

    @property
    def baseline(self) -> CommissionedTorque:
        """The gait cycles as the baseline of a leg."""
        signatures = np.array([cycle.signature for cycle in self.cycles])
        return CommissionedTorque(self.cycles[-1].end_ns, self.new_m, signatures, speed=self.profile.speed)


def walk_of(
    recordings: Sequence[Recordable],
    config: MonitorConfig,
    joint_states: str | None,
    drive_torque: str | None,
) -> Walk:
    """What the monitor sees in recordings of a healthy leg.

    Parameters
    ----------
    recordings : sequence
        Of the leg with the crank's zero of the parameters.
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
    mechanism = fitted(load_mechanism(config.mechanism), config)
    monitor, cycles, mismatch = WearMonitor(load_mechanism(config.mechanism), config), [], []
    size_nm = torque_size(build_linkage(mechanism), config.cadence.commanded_rpm / 60.0 * TURN)
    state = TorqueState(np.zeros(len(mechanism.clearance_joints)))
    with Recording(recordings, config, joint_states=joint_states, drive_torque=drive_torque) as recording:
        for block in recording.blocks():
            state.samples = state.samples.extended(block.samples)
            for one in monitor.update(block.samples).cycles:
                mismatch.append(one.torque_mismatch)
                cycles += _signed(state, one, config, size_nm)
                state.samples = state.samples.after(one.stamp_ns)
    return Walk(mechanism, config, np.array(mismatch), tuple(cycles[_SETTLING:]), state.sensor)


def _signed(
    state: TorqueState, report: CycleReport, config: MonitorConfig, size_nm: float
) -> list[SignedCycle]:
    """A gait cycle, if it was walked as commanded, without gaps, and has a signature."""
    if not config.cadence.allows(report.cadence_rpm) or report.bridged_s > 0.0:
        return []
    find_sensor(state, report.begin_ns, report.stamp_ns, config, size_nm)
    found = signed_cycle(state, report.begin_ns, report.stamp_ns)
    return [] if isinstance(found, NotUsed) else [found]
