"""README: CI runs its commands in their order; here is what needs no run."""

import configparser
import re
import shlex
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import command_line
import pytest
import readme_commands

ROOT = Path(__file__).parents[2]
TEXT = readme_commands.README.read_text(encoding="utf-8")
INSTALLED = ROOT / "docs" / "installation.md"


def lines(text):
    """Words of each command in a page's blocks of shell."""
    shell = [content for language, content in readme_commands.blocks(text) if language == "sh"]
    return [words for content in shell for line in content.splitlines() if (words := shlex.split(line, True))]


def executables():
    """What ``ros2 run leg_wear_monitor`` finds."""
    setup = configparser.ConfigParser()
    setup.read(ROOT / "setup.cfg")
    scripts = setup["options.entry_points"]["console_scripts"]
    return {line.split("=")[0].strip() for line in scripts.splitlines() if line}


def unknown_to_ros(words):
    """The executable or launch file of a ``ros2`` command, if it is not there."""
    known = {"run": executables(), "launch": {path.name for path in (ROOT / "launch").iterdir()}}
    _, verb, package, name = words[:4]
    package_name = ElementTree.parse(ROOT / "package.xml").findtext("name")
    return [] if package == package_name and name in known[verb] else [name]


def test_ci_runs_the_script():
    run = (ROOT / ".ci" / "run").read_text()
    assert "\nreadme=$(python3 test/readme_commands.py)\n" in run and ' bash -ex -c "$readme"\n' in run


def test_the_script_has_every_command_in_order():
    written = [words[0] for words in lines(TEXT) if words[0] != "ros2"]
    script = readme_commands.script(TEXT)
    begun = [shlex.split(line, True)[0] for line in script.splitlines() if re.match(r"[a-z0-9.-]+ ", line)]
    assert [word for word in begun if word in written] == written
    assert {"make", "pip", "leg-wear-monitor"} <= set(written)
    assert subprocess.run(["bash", "-n", "-c", script], check=False).returncode == 0


def test_a_snippet_arrives_as_it_is_written():
    page = (
        "```sh\ntrue  # 1\n```\n\n```python\nprint('a\"b $HOME')\n```\n\n```sh\nros2 run x y\necho 2\n```\n"
    )
    script = readme_commands.script(page).replace("python", sys.executable)
    done = subprocess.run(["bash", "-e", "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == 'a"b $HOME\n\n2\n' or done.stdout == 'a"b $HOME\n2\n'


def test_a_block_that_would_not_be_run_is_refused():
    with pytest.raises(ValueError, match="Expected sh or python"):
        readme_commands.script("```\nmake all\n```\n")


@pytest.mark.parametrize("page", [readme_commands.README, INSTALLED], ids=lambda page: page.name)
def test_what_ros_is_told_to_start_is_there(page):
    named = re.findall(r"(ros2 (?:run|launch) [^\n`]+)", page.read_text(encoding="utf-8"))
    assert named and [name for each in named for name in unknown_to_ros(shlex.split(each, True))] == []


def test_targets_and_verbs_of_every_page_are_there():
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    listed = command_line.run("--help").out.split("Commands:\n")[1]
    verbs = {line.split()[0] for line in listed.splitlines()}
    pages = [readme_commands.README, *ROOT.glob("docs/**/*.md")]
    for page in pages:
        text = page.read_text(encoding="utf-8")
        assert set(re.findall(r"`make ([a-z-]+)`", text)) <= targets, page
        named = re.findall(r"(?:^|`)leg-wear-monitor ([a-z][a-z-]*)", text, re.MULTILINE)
        assert set(named) <= verbs, page
