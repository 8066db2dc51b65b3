"""Commands, their arguments, options and defaults are those that are kept; this file as a script renews them.

python test/doors/test_commands.py
"""

import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

KEPT = Path(__file__).parent / "kept" / "commands.txt"


def section(text: str, title: str) -> list[str]:
    """Entries of a section of a help; what is indented further goes on with the entry before."""
    found = re.search(rf"^{title}:\n((?:  .*\n?|\n)*)", text, re.MULTILINE)
    return re.split(r"\n  (?=\S)", "\n" + found[1])[1:] if found else []


def promised(entry: str) -> str:
    """Names and argument of an option, and what its help says in brackets: default, bounds, required."""
    name, _, rest = entry.partition("\n") if "  " not in entry.split("\n")[0] else entry.partition("  ")
    brackets = re.findall(r"\[((?:default:|required|x?[<>=\d.]+x?)[^]]*)\]", " ".join(rest.split()))
    return "  " + "  ".join([name.strip(), *(each for bracket in brackets for each in bracket.split("; "))])


def commands(help_of: Callable[..., str], *verb: str) -> Iterator[str]:
    """A line a command, one each of its options; by what ``--help`` of each verb says."""
    text = help_of(*verb)
    usage = re.match(r"Usage: (?:python -m )?leg.wear.monitor\S* ?(.*)", text)
    yield usage[1] if usage else text
    yield from (promised(entry) for entry in section(text, "Options"))
    for entry in section(text, "Commands"):
        yield from commands(help_of, *verb, entry.split()[0])


def test_commands_and_options_are_those_that_are_kept(run) -> None:
    found = list(commands(lambda *verb: run(*verb, "--help").out))
    assert found == KEPT.read_text().splitlines(), "if it is meant: python test/doors/test_commands.py"


def printed(*verb: str) -> str:
    line = [sys.executable, "-m", "leg_wear_monitor", *verb, "--help"]
    return subprocess.run(line, capture_output=True, text=True, check=True).stdout


if __name__ == "__main__":
    KEPT.write_text("\n".join([*commands(printed), ""]))
