"""The mismatch of the drive torque that a healthy leg has with the monitor itself, and the limit for it."""

import math
from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.bags.bag import Recordable
from leg_wear_monitor.bags.reader import Recording
from leg_wear_monitor.commissioning.result.commissioning_result import CommissioningItem
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.monitor.config.settings import LedgerFile, MonitorConfig
from leg_wear_monitor.monitor.wear_monitor import WearMonitor

LIMIT = "limits.torque_mismatch"

_LEAST_CYCLES = 10
# scatters of a gait cycle's mismatch by which a warning is above its mean: by chance less than once in 1e6
_SIGMAS = 5.3


def mismatch_item(
    recordings: Sequence[Recordable],
    config: MonitorConfig,
    joint_states: str | None,
    drive_torque: str | None,
) -> CommissioningItem | None:
    """Limit of the mismatch by what the recordings of a healthy leg have; None with too few gait cycles.

    A given limit stays where it is enough.

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
    monitor = WearMonitor(load_mechanism(config.mechanism), config)
    with Recording(recordings, config, joint_states=joint_states, drive_torque=drive_torque) as recording:
        cycles = [one for block in recording.blocks() for one in monitor.update(block.samples).cycles]
    found = np.array([one.torque_mismatch for one in cycles])
    found = found[np.isfinite(found)]
    if len(found) < _LEAST_CYCLES:
        return None
    mean, scatter = float(found.mean()), float(found.std(ddof=1))
    least = (mean + _SIGMAS * scatter) / config.limits.warn_fraction
    given = config.limits.torque_mismatch
    return CommissioningItem(
        name=LIMIT,
        value=given if least <= given else math.ceil(100.0 * least) / 100.0,
        sigma=scatter,
        remark=f"{mean:.2g} in {len(found)} gait cycles of this leg",
    )
