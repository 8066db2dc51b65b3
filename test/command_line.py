"""The command line, ``python -m leg_wear_monitor``, in this process, which has loaded the kernels."""

import runpy
import signal
import sys
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from unittest.mock import patch

import attrs

FAULTS = ("error: ", "warning: ", "note: ")


@attrs.frozen
class Done:
    """Exit code, stdout, stderr, and the lines on stderr that tell of a fault."""

    code: int
    out: str
    err: str

    @property
    def lines(self) -> list[str]:
        """Lines of stderr, but for those of progress and of compilation."""
        return [line for line in self.err.splitlines() if line.startswith(FAULTS)]


def run(*arguments: object) -> Done:
    """Call the command line; a bug's exception is raised, not swallowed."""
    out, err, code = StringIO(), StringIO(), 0
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    line = ["leg-wear-monitor", *map(str, arguments)]
    try:
        with patch.object(sys, "argv", line), redirect_stdout(out), redirect_stderr(err):
            runpy.run_module("leg_wear_monitor", run_name="__main__", alter_sys=True)
    except SystemExit as end:
        code = int(end.code or 0)
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    return Done(code, out.getvalue(), err.getvalue())
