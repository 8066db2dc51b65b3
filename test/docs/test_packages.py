"""The map of decision 0010 is the source as it stands."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "leg_wear_monitor"
PAGE = (ROOT / "docs" / "decisions" / "0010-packages.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| `(.+?)` \| .* \| `(.+?)` \|$", PAGE, re.MULTILINE)


def test_it_names_every_package_once():
    folders = [f"{folder.name}/" for folder in PACKAGE.iterdir() if (folder / "__init__.py").is_file()]
    files = [file.name for file in PACKAGE.glob("*.py") if not file.name.startswith("__")]
    assert sorted(package for package, _ in ROWS) == sorted(folders + files)


def test_every_file_and_folder_that_it_names_is_there():
    named = set(re.findall(r"`([a-z_/]+(?:/|\.py))`", PAGE))
    assert len(named) > 30
    assert [name for name in named if not (PACKAGE / name).exists()] == []


def test_the_first_file_of_a_package_is_in_it():
    assert all(first == package or first.startswith(package) for package, first in ROWS)
