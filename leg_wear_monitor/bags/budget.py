"""How much memory a recording may take, whatever it claims: temporary files included."""

import attrs

from leg_wear_monitor.bags.findings import DamageError
from leg_wear_monitor.errors import ConfigError

DEFAULT_MB = 512.0
_LEAST_MB = 16.0
_MB = 1_000_000


@attrs.define
class Budget:
    """Bytes that reading may take, and what of them is taken for as long as the recording is open.

    Parameters
    ----------
    megabytes : float
        Of 10⁶ bytes; at least 16.

    Raises
    ------
    ConfigError
        For less.
    """

    megabytes: float = DEFAULT_MB
    taken: int = attrs.field(init=False, default=0)

    def __attrs_post_init__(self) -> None:
        if not self.megabytes >= _LEAST_MB:
            text = f"{self.megabytes:g} MB is too little, expected at least {_LEAST_MB:g} MB"
            raise ConfigError("--memory-mb", "", text)

    @property
    def left(self) -> int:
        """Bytes that are not taken."""
        return max(0, int(min(self.megabytes, 1.0e12) * _MB) - self.taken)

    @property
    def at_once(self) -> int:
        """Bytes that one part of a file may need while it is read; samples that wait need the rest."""
        return self.left // 2

    def check(self, needed: int) -> None:
        """See that a part of a file can be read.

        Raises
        ------
        DamageError
            If it needs too much, in words that follow its name.
        """
        if needed > self.at_once:
            raise DamageError(
                f"needs {needed / _MB:.0f} MB to be read, more than the {self.at_once / _MB:.0f} MB that "
                f"--memory-mb {self.megabytes:g} leaves for it"
            )

    def take(self, needed: int) -> None:
        """Take bytes until the recording is closed, as for a temporary file.

        Raises
        ------
        DamageError
        """
        if needed > self.left:
            raise DamageError(f"needs larger temporary files than --memory-mb {self.megabytes:g} allows")
        self.taken += needed
