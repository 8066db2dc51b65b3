"""Command lines that cannot be: exit code 2, one line that names option, value and what was expected."""

import pytest

# arguments, and what the line must say
WRONG = [
    ("", ["no command", "check, ", "--help"]),
    ("fleet", ["error: Missing command. (see", "fleet --help)"]),
    ("simulat", ["'simulat'", "check, ", "did you mean simulate?"]),
    ("simulate --clearence A", ["--clearence", "--clearance"]),
    ("simulate bionic_leg", ["bionic_leg", "unexpected"]),
    ("simulate --json", ["--json", "argument"]),
    ("simulate --cycles many", ["--cycles", "'many'", "is not a valid float"]),
    ("simulate --cycles 0", ["--cycles", "x>0"]),
    ("simulate --duration -1", ["--duration", "-1", "x>0"]),
    ("simulate --duration inf", ["--duration", "inf", "finite number"]),
    ("simulate --duration 1 --cycles 1", ["--duration", "--cycles", "cannot be combined"]),
    ("simulate --skip-cycles -1", ["--skip-cycles", "-1", "x>=0"]),
    ("simulate --trace -1", ["--trace", "-1", "0"]),
    ("simulate --model half", ["--model", "'half'", "clearance", "full"]),
    ("simulate --normal-law newton", ["--normal-law", "'newton'", "flores"]),
    ("simulate --speed-rpm 0", ["--speed-rpm", "0.0 rpm", "Expected at least 0.01 rpm in either direction"]),
    ("simulate --clearance-m 0", ["--clearance-m", "0", "x>0"]),
    ("simulate --clearance-m 0.1", ["--clearance-m", "0.1", "bushing_radius of 0.01 m"]),
    ("simulate --clearances Q", ["--clearances", "'Q'", "bionic_leg.yaml", "A, B, C"]),
    ("design --clearances Z", ["--clearances: 'Z'", "bionic_leg.yaml", "A, B, C"]),
    ("life --clearances A,A", ["--clearances", "'A,A'", "twice"]),
    ("life --mechanism andrews", ["andrews.yaml: clearances.joints: no joint has clearance, so nothing can"]),
    ("design andrews", ["andrews.yaml: clearances.joints: no joint has clearance, so nothing can"]),
    ("simulate --clearances A,A", ["--clearances", "'A,A'", "twice"]),
    ("simulate --mechanism andrews --clearances O", ["--clearances", "'O'", "andrews.yaml", "none"]),
    ("simulate --mechanism andrews", ["andrews.yaml", "drive.torque", "--duration"]),
    ("simulate --mechanism andrews --duration 1 --speed-rpm 9", ["--speed-rpm", "9 rpm", "torque"]),
    ("simulate --mechanism dog_leg", ["dog_leg", "./leg.yaml", "bionic_leg"]),
    ("simulate --clearances a,B", ["--clearances", "'a'", "did you mean A?"]),
    ("simulate --mechanism dog_leg.yaml", ["dog_leg.yaml", "No such file"]),
    ("simulate --mechanism four_bar.yaml", ["four_bar.yaml", "No such file", "four_bar without .yaml"]),
    ("simulate --mechanism ./", [".", "no mechanism"]),
    ("check dog_leg.yaml", ["dog_leg.yaml", "No such file"]),
    ("check /", ["/", "cannot be read", "directory"]),
]


@pytest.mark.parametrize(("line", "said"), WRONG, ids=[line for line, _ in WRONG])
def test_a_wrong_command_line_is_one_line(refused, line, said):
    complaint = refused(*line.split())
    assert complaint.startswith("error: ")
    for part in said:
        assert part in complaint


@pytest.mark.parametrize(
    ("option", "target", "said"),
    [
        ("--json", "nowhere/result.json", "cannot be written: No such file"),
        ("--json", ".", "is a directory. Expected a file"),
        ("--json", "file/result.json", "cannot be written: Not a directory"),
        ("--json", "/proc/result.json", "cannot be written"),
        ("--out", "file", "cannot be written: Not a directory"),
        ("--out", "file/deeper", "cannot be written: Not a directory"),
        ("--out", "/proc/run", "cannot be written"),
    ],
)
def test_a_target_that_cannot_be_written_is_found_before_the_run(refused, tmp_path, option, target, said):
    """The run would take hours."""
    (tmp_path / "file").write_text("in the way")
    complaint = refused("simulate", "--cycles", "1e5", option, target)
    assert complaint.startswith(f"error: {option}: {target}: ")
    assert said in complaint
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_check_names_every_bad_file_and_describes_the_good(run, shipped, tmp_path):
    (tmp_path / "one.yaml").write_text(shipped("four_bar").replace("mass: 0.40", "mass: 0"))
    (tmp_path / "two.yaml").write_text(shipped("four_bar").replace("gravity", "gravitas"))
    (tmp_path / "good.yaml").write_text(shipped("four_bar"))
    result = run("check", "one.yaml", "good.yaml", "two.yaml")
    assert result.code == 2
    one, two = result.lines
    assert one == "error: one.yaml: bodies.crank.mass: 0.0 is not above 0 kg"
    assert two == "error: two.yaml: gravitas: unknown key, did you mean gravity?"
    assert result.out.startswith("good.yaml")
    for part in ("3 moving bodies", "4 joints", "clearance joints B, C", "mobility 1", "turns through"):
        assert part in result.out


def test_check_doubts_another_unit_and_says_what_it_understood(run, shipped, tmp_path):
    text = shipped("four_bar")
    (tmp_path / "good.yaml").write_text(text)
    (tmp_path / "soft.yaml").write_text(text.replace("2.07e11", "207"))
    good, soft = run("check", "good.yaml"), run("check", "soft.yaml")
    assert (good.code, good.lines) == (0, [])
    for part in (
        "largest link",
        "heaviest mass",
        "120 rpm counter-clockwise",
        "E 207 GPa",
        "0.2 mm in a radius of 8 mm",
    ):
        assert part in good.out
    assert soft.code == 1
    line, *consequences = soft.lines
    assert line.startswith("warning: soft.yaml: clearances (")
    assert "youngs_modulus: 207 Pa" in line
    assert line.endswith("Is it in GPa?")
    assert consequences and all("contact half angle" in each for each in consequences)
