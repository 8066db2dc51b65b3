"""A monitor with the ledger that its parameters name, from the one to the other without a gap."""

from leg_wear_monitor.interrupt import closed_at_the_end
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.ledger.ledger import open_ledger
from leg_wear_monitor.monitor.wear_monitor import WearMonitor
from leg_wear_monitor.twin.sampling.settings import SamplingSettings


def open_monitor(
    mechanism: Mechanism,
    config: MonitorConfig,
    at_end: bool = False,
    sampling: SamplingSettings | None = None,
) -> WearMonitor:
    """Open the ledger and build the monitor that continues it.

    Building takes seconds, and a minute where kernels are compiled: if it is cut short, the ledger must not
    look as if a run that monitored something had been.

    Parameters
    ----------
    mechanism : Mechanism
    config : MonitorConfig
    at_end : bool
        Whether the ledger is written at the end of the run alone, see `open_ledger`.
    sampling : SamplingSettings, optional
        Follow blocks of gait cycles only.

    Raises
    ------
    ConfigError, LedgerError
        For parameters or a ledger that cannot be used.
    """
    ledger = open_ledger(mechanism, config, at_end)
    if ledger is None:
        return WearMonitor(mechanism, config, sampling=sampling)
    with closed_at_the_end(ledger.abandon):
        try:
            return WearMonitor(mechanism, config, ledger, sampling)
        except BaseException:
            ledger.abandon()
            raise
