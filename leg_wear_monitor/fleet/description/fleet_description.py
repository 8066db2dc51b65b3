"""The legs of a fleet as a description names them, with their recordings and parameters."""

import hashlib
from pathlib import Path

import attrs

from leg_wear_monitor.errors import printable
from leg_wear_monitor.monitor.config.settings import MonitorConfig


@attrs.frozen(kw_only=True)
class FleetLeg:
    """One leg.

    Attributes
    ----------
    id : str
        Name of the leg; its directories are named after it.
    lot : str
        Production lot of its joints; empty if it is not known.
    config : MonitorConfig
        Parameters of its monitor.
    config_file : pathlib.Path or None
        File of these parameters; None for those of the package.
    recordings : tuple of pathlib.Path
        Recordings, sorted by name.
    home : pathlib.Path
        Directory of the description.
    row : str
        Row of the table of cycles, ``minute`` or ``cycle``.
    node, joint_states, drive_torque : str or None
        As in `leg_wear_monitor.replay`.
    learned_priors : str
        File with the priors of its wear coefficients that the fleet has learned; empty without.
    sample : float, optional
        Fraction of the gait cycles that are followed, as in `leg_wear_monitor.replay`.
    """

    id: str
    lot: str
    config: MonitorConfig
    recordings: tuple[Path, ...]
    home: Path
    row: str
    node: str | None
    joint_states: str | None
    drive_torque: str | None
    learned_priors: str = ""
    sample: float | None = None
    config_file: Path | None = None

    def shown(self, recording: Path) -> str:
        """Name of a recording in tables: relative to the description where it is below it, and printable."""
        is_below = recording.is_relative_to(self.home)
        return printable(str(recording.relative_to(self.home) if is_below else recording))

    def with_priors(self, file: Path) -> "FleetLeg":
        """The leg with what its fleet has learned for its forecasts, unless its parameters name a file."""
        if self.config.forecast.priors or self.learned_priors:
            return self
        return attrs.evolve(self, learned_priors=str(file))

    @property
    def used_config(self) -> MonitorConfig:
        """Parameters of its monitor, with what its fleet has learned."""
        if not self.learned_priors:
            return self.config
        forecast = attrs.evolve(self.config.forecast, priors=self.learned_priors)
        return attrs.evolve(self.config, forecast=forecast)

    @property
    def settings(self) -> str:
        """Digest of what decides whether a recording can be read and fits the leg."""
        parts = (self.config, self.node, self.joint_states, self.drive_torque)
        return hashlib.sha256(repr(parts).encode()).hexdigest()[:20]


@attrs.frozen(kw_only=True)
class FleetDescription:
    """A fleet.

    Attributes
    ----------
    path : pathlib.Path
        File of the description.
    out : pathlib.Path
        Directory of the fleet.
    legs : tuple of FleetLeg
        In the order of the file.
    """

    path: Path
    out: Path
    legs: tuple[FleetLeg, ...]
