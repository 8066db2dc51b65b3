"""Broken mechanism files: exit code 2, one line that names file, key, value and what was expected."""

import pytest

DRIVE = "drive: {body: crank, speed: 6.283185307179586}"
CRANK_POSE = "  crank:   [0.0, 0.0, 0.0]\n"
JOINT = "A: {bushing: ground, journal: crank,"
SPRING = "\nsprings: {s: {bodies: [shank, foot], points: [G, I], stiffness: 1.0, free_length: 0.0}}"
LOAD = "\nloads: {f: {body: foot, point: toe, phase: [0.0, 0.5], force: [[0.0, 1.0], [0.0, 2.0]]}}"

# what is replaced in bionic_leg.yaml, by what, and what the line must say
BROKEN = [
    # a value that is no such thing, or out of bounds
    ("mass: 3.5", "mass: -4.0", ["bodies.thigh.mass", "-4.0", "not above 0 kg"]),
    ("mass: 3.5", "mass: heavy", ["bodies.thigh.mass", "'heavy'", "not a number [kg]"]),
    ("mass: 3.5", "mass: '3.5'", ["bodies.thigh.mass", "'3.5'", "not a number [kg]"]),
    ("mass: 3.5", "mass: .nan", ["bodies.thigh.mass", "nan", "not a finite number [kg]"]),
    ("mass: 3.5", "mass: true", ["bodies.thigh.mass", "True", "not a number [kg]"]),
    ("mass: 3.5", "mass: null", ["bodies.thigh.mass", "nothing", "not a number [kg]"]),
    ("mass: 3.5", "mass: 2001-13-45", ["not YAML", "month"]),
    ("mass: 3.5", "mass: " + 9 * "9999999999" * 60, ["not YAML", "digits"]),
    ("com: [0.180, 0.0]", "com: [0.180]", ["bodies.thigh.com", "[0.18]", "2 numbers [m]"]),
    ("G: [0.420, 0.0]", "G: [0.420, left]", ["bodies.thigh.points.G", "'left'", "number [m]"]),
    ("[0.086, 0.0, -1.740340]", "[0.086, 0.0]", ["assembly.coupler", "3 numbers [m, m, rad]"]),
    ("gravity: [0.0, -9.81]", "gravity: down", ["gravity", "'down'", "2 numbers [m/s^2]"]),
    ("speed: 6.283185307179586", "speed: 0", ["drive.speed", "0.0 rad/s", "Expected a speed"]),
    ("restitution: 0.9", "restitution: 1.9", ["clearances.defaults.restitution", "1.9", "at most 1"]),
    ("restitution: 0.9", "restitution: 0.01", ["clearances.defaults.restitution", "0.01", "at least 0.02"]),
    ("[0.29, 0.29]", "[0.29, 0.79]", ["clearances.defaults.poissons_ratio", "0.79", "at most 0.5"]),
    ("radial_clearance: 0.0003", "radial_clearance: 0.3", ["defaults.radial_clearance", "0.3", "0.01 m"]),
    ("normal_law: lankarani-nikravesh", "normal_law: herz", ["defaults.normal_law", "'herz'", "hertz, "]),
    ("law: ambrosio", "law: coulomb", ["defaults.friction.law", "'coulomb'", "ambrosio, threlfall"]),
    ("ramp: [0.001, 0.01]", "ramp: [0.1, 0.01]", ["friction.ramp", "[0.1, 0.01] m/s", "not above the first"]),
    ("joints: [A, B, G, I, J]", "joints: {A: {width: -1}}", ["clearances.joints.A.width", "-1.0", "0 m"]),
    ("label: knee", "label: <b>knee</b>", ["joints.G.label", "'<b>knee</b>'", "letters, digits"]),
    # keys
    ("mass: 3.5", "mas: 3.5", ["bodies.thigh.mas", "unknown key", "did you mean mass?"]),
    ("mass: 3.5, ", "", ["bodies.thigh.mass", "missing", "[kg]"]),
    ("mass: 3.5", "mass: 3.5, mass: 3.6", ["line 18", 'duplicate key "mass"']),
    ("gravity:", "gravitation:", ["gravitation", "unknown key", "did you mean gravity?"]),
    ("gravity: [0.0, -9.81]\n", "", ["gravity", "missing", "[m/s^2]"]),
    ("gravity:", "9.81: 1\ngravity:", ["the key 9.81", "not a text"]),
    ("  crank:   {mass", "  7: {mass", ["bodies", "the key 7", "not a text"]),
    ("width: 0.020 ", "breadth: 0.020 ", ["defaults.breadth", "unknown key", "width"]),
    ("    width: 0.020 ", "    # ", ["clearances.joints.A.width", "missing", "[m]"]),
    ("  defaults:", "  default:", ["clearances.default", "unknown key", "did you mean defaults?"]),
    ("  crank:   {mass", '  "cr\\nank": {mass', ["bodies", "'cr\\nank'", "text on one line"]),
    ("name: bionic_leg", 'name: "a\\nb"', ["name", "'a\\nb'", "text on one line"]),
    # what is spoken of is not there
    (JOINT, "A: {bushing: ground, journal: crnk,", ["joints.A.journal", "'crnk'", "ground, crank"]),
    ("G: [0.420, 0.0], ", "", ["joints.G.journal", "'thigh'", "'G'", "B, H"]),
    (JOINT, "A: {bushing: ground, journal: ground,", ["joints.A", "'ground'", "itself"]),
    (JOINT, "A: {bushing: ground, kind: ball,", ["joints.A.kind", "'ball'", "revolute, prismatic"]),
    ("body: crank", "body: ground", ["drive.body", "'ground'", "not a moving body", "crank, thigh"]),
    ("speed: 6.283185307179586", "", ["drive", "speed [rad/s], torque [N m]"]),
    ("speed: 6.28", "torque: 1, speed: 6.28", ["drive", "speed and torque", "Expected one of"]),
    (CRANK_POSE, "", ["assembly.crank", "missing", "[m, m, rad]"]),
    (CRANK_POSE, CRANK_POSE + "  arm: [0, 0, 0]\n", ["assembly.arm", "'arm'", "not a moving body"]),
    ("[A, B, G, I, J]", "[A, Q]", ["clearances.joints.Q", "not a joint", "A, B, C"]),
    ("[A, B, G, I, J]", "[A, B, A]", ["clearances.joints", "['A', 'B', 'A']", "twice"]),
    (DRIVE, DRIVE + SPRING.replace("[G, I]", "[G, K]"), ["springs.s.points", "'foot'", "'K'", "I, J, toe"]),
    (DRIVE, DRIVE + SPRING.replace("[shank, foot]", "[shank]"), ["springs.s.bodies", "2 texts"]),
    (DRIVE, DRIVE + LOAD.replace("toe", "heel"), ["loads.f.point", "'foot'", "'heel'", "toe"]),
    (DRIVE, DRIVE + LOAD.replace("0.5", "1.5"), ["loads.f.phase", "[0.0, 1.5]", "below 1"]),
    (DRIVE, DRIVE + LOAD.replace("[0.0, 0.5]", "[0.0]"), ["loads.f.force", "2 forces for 1 phases"]),
    # not YAML, or not a mechanism
    ("bodies:", "bodies: [", ["not YAML", "line 18"]),
    ("bodies:", "\tbodies:", ["not YAML", "line 16", "'\\t'"]),
    ("bodies:", "bodies: *them", ["not YAML", "line 17"]),
    ("name: bionic_leg", "name: \x07", ["not YAML", "#x0007"]),
    ("bodies:", "bodies: 7\nrest:", ["rest", "unknown key"]),
    # a linkage that cannot be, or cannot turn
    ("  F: {bushing: shank, journal: coupler}", "  #", ["joints", "mobility is 3", "Expected 1"]),
    ("D: [0.356, 0.0]", "D: [0.056, 0.0]", ["assembly", "joint", "open by", "mm"]),
    ("C: [0.086, 0.0]", "C: [0.286, 0.0]", ["leg.yaml"]),
]


@pytest.mark.parametrize(
    ("old", "new", "said"), BROKEN, ids=[f"{old} > {new[:40]}" for old, new, _ in BROKEN]
)
def test_a_broken_file_is_one_line(refused, shipped, tmp_path, old, new, said):
    text = shipped("bionic_leg")
    assert old in text
    (tmp_path / "leg.yaml").write_text(text.replace(old, new, 1))
    line = refused("check", "leg.yaml")
    assert line.startswith("error: leg.yaml: ")
    for part in said:
        assert part in line
