"""Memory limit of a reader, independent of the sizes that a file declares."""

import attrs

from leg_wear_monitor.bags.findings import DamageError
from leg_wear_monitor.errors import ConfigError

DEFAULT_MB = 512.0  # default of --memory-mb
_MIN_MB = 16.0
_MB = 1_000_000


@attrs.define
class Budget:
    """Memory limit of a reader.

    Parameters
    ----------
    megabytes : float
        Memory limit [10⁶ bytes]; at least 16.

    Raises
    ------
    ConfigError
        If the limit is below 16 MB.
    """

    megabytes: float = DEFAULT_MB

    def __attrs_post_init__(self) -> None:
        if not self.megabytes >= _MIN_MB:
            text = f"{self.megabytes:g} MB is too little, expected at least {_MIN_MB:g} MB"
            raise ConfigError("--memory-mb", "", text)

    @property
    def available(self) -> int:
        """Bytes of the limit."""
        return int(min(self.megabytes, 1.0e12) * _MB)  # infinity, which means no limit, has no integer

    @property
    def part_limit(self) -> int:
        """Bytes that one part of a file may use while it is read: half, the rest is for queued samples."""
        return self.available // 2

    def check(self, needed: int) -> None:
        """Check that a part of a file fits into memory.

        Raises
        ------
        DamageError
            If it needs too much memory; the text is a predicate that follows the name of the part.
        """
        if needed > self.part_limit:
            raise DamageError(
                f"needs {needed / _MB:.0f} MB to be read, more than the {self.part_limit / _MB:.0f} MB that "
                f"--memory-mb {self.megabytes:g} leaves for it"
            )
