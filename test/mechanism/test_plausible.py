"""Values in another unit are doubted, each under its key; mechanisms that are in order are not."""

import attrs
import pytest

from leg_wear_monitor import AssemblyError
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.loader import load_mechanism, parse_mechanism, shipped_mechanisms, understood
from leg_wear_monitor.mechanism.plausible import doubts, suspects
from leg_wear_monitor.monitor.config.fitting import fitted, parameter_doubts
from leg_wear_monitor.monitor.config.parameters import config_from, load_config

pytestmark = pytest.mark.plain


def in_millimetres(document):
    for part in (document["ground"], *document["bodies"].values()):
        part["points"] = {name: [1e3 * x, 1e3 * y] for name, (x, y) in part["points"].items()}
    for body in document["bodies"].values():
        body["com"] = [1e3 * x for x in body["com"]]
    for name, pose in document["assembly"].items():
        if name != "crank_angle":
            document["assembly"][name] = [1e3 * pose[0], 1e3 * pose[1], pose[2]]


def in_degrees(document):
    for name, pose in document["assembly"].items():
        if name != "crank_angle":
            pose[2] *= 57.29577951308232


def set_default(key, value):
    return lambda document: document["clearances"]["defaults"].__setitem__(key, value)


def of_thigh(key, factor):
    def change(document):
        document["bodies"]["thigh"][key] *= factor

    return change


SLIPS = [
    (in_millimetres, "bodies.coupler.points: 614.818 m from point to point", "mm for m?"),
    (in_degrees, "assembly.thigh: -108.945 rad is -17.3 turns", "degrees for rad?"),
    (lambda d: d["drive"].update(speed=60), "drive.speed: 60 rad/s is 573 rpm", "60 rpm is 6.28319 rad/s"),
    (
        set_default("youngs_modulus", 207),
        "clearances (A, B, C, D, E, F, G, H, I, J): youngs_modulus: 207 Pa, usual are 1e6 to 2e12 Pa",
        "GPa for Pa?",
    ),
    (set_default("youngs_modulus", 2.07e5), "youngs_modulus: 207000 Pa", "MPa for Pa?"),
    (of_thigh("mass", 1e3), "bodies.thigh.mass: 3500 kg", "g for kg?"),
    (of_thigh("inertia", 1e6), "bodies.thigh.inertia", "kg mm^2 for kg m^2?"),
    (lambda d: d.update(gravity=[0, -9810]), "gravity: 9810 m/s^2", "mm/s^2 for m/s^2?"),
    (lambda d: d["bodies"]["thigh"].update(com=[180, 0]), "bodies.thigh.com: 180 m away", "mm for m?"),
    (set_default("radial_clearance", 3e-8), "radial_clearance: 3e-08 m is 0.0003 %", "another unit"),
    (set_default("wear_coefficient", 1e-4), "wear_coefficient: 0.0001 1/Pa", "K for K/H"),
]


@pytest.mark.parametrize(("slip", "said", "hint"), SLIPS)
def test_a_value_in_another_unit_is_doubted(document, slip, said, hint):
    changed = document("bionic_leg")
    slip(changed)
    found = [str(doubt) for doubt in doubts(parse_mechanism(changed, "leg.yaml"))]
    assert any(said in line and hint in line for line in found), found
    assert all("\n" not in line for line in found)
    assert len(found) <= 2


@pytest.mark.parametrize("name", sorted(shipped_mechanisms()))
def test_what_comes_with_the_package_is_not_doubted(name):
    leg = load_mechanism(name)
    assert doubts(leg) == ()
    assert suspects(leg) == ""


def test_what_does_not_move_names_what_is_doubted(document):
    changed = document("bionic_leg")
    changed["assembly"]["coupler"][2] = -99.7
    with pytest.raises(AssemblyError, match=r"look at assembly.coupler: -99.7 rad .* degrees for rad\?"):
        prepare(parse_mechanism(changed, "leg.yaml"))


def test_what_was_understood_has_units(linkage_of, leg):
    text = " | ".join(understood(linkage_of("bionic_leg")))
    for part in (
        "largest link 0.6148 m (coupler)",
        "heaviest mass 3.5 kg (thigh)",
        "crank 60 rpm counter-clockwise",
        "toe's stride 0.",
        "E 207 GPa",
        "clearance 0.3 mm in a radius of 10 mm (3 %)",
    ):
        assert part in text
    assert "crank driven by 0.033 N m" in understood(linkage_of("andrews"))
    back = attrs.evolve(leg, drive=attrs.evolve(leg.drive, speed=-leg.drive.speed))
    assert "crank 60 rpm clockwise" in understood(linkage_of("bionic_leg")._replace(mechanism=back))


PARAMETERS = [
    (
        {"wear_coefficients_per_pa": [1e-15, 1e-15, 1e-6, 1e-15, 1e-15]},
        "wear_coefficients_per_pa: 1e-06 1/Pa, usual are below 1e-9 1/Pa",
        "mm^3/(N m), which is 1e-9 1/Pa?",
    ),
    ({"cadence.commanded_rpm": 6.2832}, "cadence.commanded_rpm: 6.2832 rpm is 9.55 s", "is 60 rpm"),
    (
        {"wear_acceleration": 5000.0},
        "multiplies all wear by 5000: a demonstration",
        "above 1000, the walls get",
    ),
    ({"crank.offset_rad": 90.0}, "crank.offset_rad: 90 rad", "degrees for rad?"),
    ({"limits.clearance_m": 2e-4}, "limits.clearance_m: 0.0002 m is not above the new clearance", "A"),
    (
        {"drive.stiffness_nm_per_rad": 0.5},
        "drive.stiffness_nm_per_rad: 0.5 N m/rad",
        "usual are 5 to 1e7 N m/rad",
    ),
    ({"drive.bandwidth_hz": 0.066}, "drive.bandwidth_hz: 0.066 Hz, usual are 1 to 2e4 Hz", "kHz for Hz?"),
    ({"drive.lag_s": 0.5}, "drive.lag_s: 0.5 s, usual are below 0.1 s", "ms for s?"),
    ({"drive.coulomb_nm": 370.0}, "drive.coulomb_nm: 370 N m, usual are below 100 N m", "N mm for N m?"),
    ({"limits.impact_force_n": 1.5}, "limits.impact_force_n: 1.5 N", "kN for N?"),
    ({"limits.joint_impact_force_n": [1.5] + [1e4] * 4}, "limits.joint_impact_force_n: 1.5 N", "kN for N?"),
    (
        {"clearances_m": [3e-3], "limits.clearance_m": 5e-3},
        "clearances_m: 0.003 m is 30 % of the bushing's radius",
        "mm for m",
    ),
]


@pytest.mark.parametrize(("values", "said", "hint"), PARAMETERS)
def test_a_parameter_in_another_unit_is_doubted(leg, values, said, hint):
    config = config_from(values)
    (found,) = map(str, parameter_doubts(config, fitted(leg, config)))
    assert said in found
    assert hint in found


def test_the_parameters_that_come_with_the_package_are_not_doubted(leg):
    assert parameter_doubts(load_config(), fitted(leg, load_config())) == ()
