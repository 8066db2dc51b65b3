"""README's commands as one bash script, in README's order; CI runs it in a fresh checkout.

``bash -ex -c "$(python3 test/readme_commands.py)"`` runs them. Whoever prints the script needs the standard
library only: nothing is installed yet.
"""

import re
import shlex
from pathlib import Path

README = Path(__file__).parents[1] / "README.md"

_BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)

# Modules come from what README installs, not from the checkout that the script runs in.
_PYTHON = "PYTHONSAFEPATH=1 python -c "


def blocks(text: str) -> list[tuple[str, str]]:
    """Language and content of each block of code."""
    return _BLOCK.findall(text)


def needs_ros(line: str) -> bool:
    """Whether a command needs a ROS workspace, which CI does not have."""
    return line.startswith("ros2 ")


def script(text: str) -> str:
    """All commands of a page but those of ``ros2``, and its snippets of Python.

    Raises
    ------
    ValueError
        If a block is in a language that is not run.
    """
    lines: list[str] = []
    for language, content in blocks(text):
        if language == "sh":
            lines += [line for line in content.splitlines() if not needs_ros(line)]
        elif language == "python":
            lines.append(_PYTHON + shlex.quote(content))
        else:
            raise ValueError(f"a block in '{language}'. Expected sh or python")
    return "\n".join(lines)


if __name__ == "__main__":
    print(script(README.read_text(encoding="utf-8")))
