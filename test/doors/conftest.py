"""The command line through its own door, and the fields that are promised."""

import runpy
import signal
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from importlib.util import find_spec
from io import StringIO
from pathlib import Path
from typing import Any
from unittest.mock import patch

import attrs
import pytest
from json_fields import is_of, leaves

if not (find_spec("mcap") and find_spec("rosbags")):  # the extra `bags` is not installed
    collect_ignore = [
        f"test_{name}.py" for name in ("diagnosis", "exit_codes", "fleet", "kills", "sample_bags")
    ]

FAULTS = ("error: ", "warning: ", "note: ")


@attrs.frozen
class Done:
    """Exit code, stdout, and the lines on stderr that tell of a fault."""

    code: int
    out: str
    lines: list[str]


@pytest.fixture(scope="session")
def run() -> Callable[..., Done]:
    """Call ``python -m leg_wear_monitor`` in this process, which has loaded the kernels already."""

    def call(*arguments: object) -> Done:
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
        lines = err.getvalue().splitlines()
        return Done(code, out.getvalue(), [line for line in lines if line.startswith(FAULTS)])

    return call


@pytest.fixture(scope="session")
def unknown() -> Callable[[str, Any], set[str]]:
    """What a document has beside the fields that are kept."""
    lines = (Path(__file__).parent / "kept" / "fields.txt").read_text().splitlines()
    fields = [line.split(": ", 2)[:2] for line in lines]

    def find(name: str, document: Any) -> set[str]:
        paths = [path.removesuffix("[]") for kind, path in fields if kind == name]
        return {leaf for leaf in set(leaves(document)) if not any(is_of(path, leaf) for path in paths)}

    return find
