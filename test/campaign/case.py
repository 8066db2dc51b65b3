"""A case of a campaign: what is done, what came of it, and what that is called."""

from collections.abc import Callable
from enum import Enum
from pathlib import Path

import attrs

CRASHED = 70  # the exit code of a child with an exception that nobody caught


class Outcome(Enum):
    """What came of a case; the last four are faults."""

    REFUSED = "refused"
    REPORTED = "reported"
    SOUND = "sound"
    SILENT = "silent"
    CRASH = "crash"
    HANG = "hang"
    MEMORY = "over memory"

    @property
    def is_fault(self) -> bool:
        return self in (Outcome.SILENT, Outcome.CRASH, Outcome.HANG, Outcome.MEMORY)


@attrs.frozen
class Ran:
    """What is left of a child: `code` is negative for a signal; `directory` is where it ran."""

    code: int
    stdout: str
    stderr: str
    directory: Path
    seconds: float
    memory_mb: float
    is_late: bool = False
    verdict: tuple[Outcome, str] | None = None

    @property
    def complaints(self) -> list[str]:
        """Lines on stderr, but for the one that says why the very first run takes long."""
        lines = self.stderr.splitlines()
        return [line for line in lines if not line.startswith("compiling numerical kernels")]


def never(_ran: Ran) -> str:
    """An ``unsound`` for cases that have to be refused or reported."""
    return "nothing was said"


def says(ran: Ran) -> bool:
    """Whether a warning was printed, or the exit code and a line say that something was found."""
    lines = ran.complaints
    return any("warning" in line.lower() for line in lines) or (ran.code == 1 and bool(lines))


@attrs.frozen
class Case:
    """One case.

    Attributes
    ----------
    description : str
        For who has to look into it: what was damaged, and how.
    run : callable
        Called in the forked child, in an empty directory that it is given and that is its working directory.
        It prints as a user would see it and ends by returning or by SystemExit. What it returns, if it is not
        None, is the verdict: an Outcome and a text.
    prepare : callable, optional
        Called before, in the parent, with the same directory: what it takes is not measured.
    is_reported : callable
        Whether what was printed names the fault.
    unsound : callable
        Why what was printed is wrong; empty if it is what it would be without damage, or rightly so.
    memory_mb, seconds : float
        Bounds; memory is counted above that of a child which does nothing.
    codes : set of int
        Exit codes that are documented.
    """

    description: str
    run: Callable[[Path], tuple[Outcome, str] | None]
    prepare: Callable[[Path], object] | None = None
    is_reported: Callable[[Ran], bool] = says
    unsound: Callable[[Ran], str] = never
    memory_mb: float = 600.0
    seconds: float = 60.0
    codes: frozenset[int] = frozenset({0, 1, 2})


def evaluated(case: Case, ran: Ran) -> tuple[Outcome, str]:
    """What came of a case, and why it is called so."""
    if ran.is_late:
        return Outcome.HANG, f"not done after {case.seconds:g} s"
    if ran.memory_mb > case.memory_mb:
        return Outcome.MEMORY, f"{ran.memory_mb:.0f} MB"
    if ran.code not in case.codes or "Traceback (most recent call last)" in ran.stderr:
        last = (ran.complaints or [""])[-1]
        return Outcome.CRASH, f"exit code {ran.code}: {last}"
    if ran.verdict is not None:
        return ran.verdict
    lines = ran.complaints
    if ran.code == 2:
        if len(lines) == 1:
            return Outcome.REFUSED, lines[0]
        return Outcome.CRASH, f"refused in {len(lines)} lines, expected one"
    if case.is_reported(ran):
        return Outcome.REPORTED, lines[0] if lines else ""
    why = case.unsound(ran)
    return (Outcome.SILENT, why) if why else (Outcome.SOUND, "")


def command_line(*arguments: str) -> Callable[[Path], None]:
    """``leg-wear-monitor`` with arguments, for `Case.run`."""

    def run(_directory: Path) -> None:
        from leg_wear_monitor.cli.main import cli

        cli.main(list(arguments), prog_name="leg-wear-monitor")

    return run
