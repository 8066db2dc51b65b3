"""Lines or rows of a table that cannot be read: the first ones are reported, the rest is counted."""

from pathlib import Path

import attrs

from leg_wear_monitor.bags.findings import Finding

_MOST = 5


@attrs.define
class LostLines:
    """Findings about lost lines of a file.

    Attributes
    ----------
    path : pathlib.Path
    findings : list of Finding
        Where the findings go.
    word : str
        What a line is called: ``line`` or ``row``.
    """

    path: Path
    findings: list[Finding]
    word: str = "line"
    count: int = attrs.field(init=False, default=0)

    def add(self, line: int, fault: str) -> None:
        """Report a line."""
        self.count += 1
        if self.count <= _MOST:
            self.findings.append(Finding(self.path, f"{self.word} {line} is lost: {fault}"))

    @property
    def left(self) -> int:
        """Number of lines that are still reported one by one."""
        return max(0, _MOST - self.count)

    def close(self) -> None:
        """Report how many more there are; after the last line."""
        if self.count > _MOST:
            self.findings.append(Finding(self.path, f"{self.count - _MOST} more {self.word}s are lost"))
