"""One twin for all monitors of a process: its tables take seconds, and a case of a campaign has none."""

from typing import Any


def keep_twin() -> None:
    """Have every monitor of the default leg from now on take the same twin, as new each time."""
    from leg_wear_monitor import MonitorConfig, load_mechanism
    from leg_wear_monitor.monitor import parts
    from leg_wear_monitor.monitor.config.fitting import fitted, twin_settings

    config = MonitorConfig()
    made = parts.DigitalTwin
    twin = made(fitted(load_mechanism(config.mechanism), config), twin_settings(config))
    twin.warm_up()
    new, settings = twin.snapshot(), twin_settings(config)

    def again(mechanism: Any, wanted: Any = None) -> Any:
        if mechanism.name != "bionic_leg" or wanted != settings:
            return made(mechanism, wanted)
        twin.restore(new)
        return twin

    parts.DigitalTwin = again  # type: ignore[assignment, misc]
