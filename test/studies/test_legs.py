"""Drawn legs and the claims on them: leg 0 is the leg of the file, and fractions count what they say."""

import json

import attrs
import numpy as np
import pytest

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.cli.verbs.study import write_study_page
from leg_wear_monitor.errors import AssemblyError, ConfigError
from leg_wear_monitor.mechanism.position import build_linkage, one_cycle
from leg_wear_monitor.report.study.page import influence_gallery
from leg_wear_monitor.report.study.text import claim_table
from leg_wear_monitor.studies import kinds
from leg_wear_monitor.studies.execution import run_study
from leg_wear_monitor.studies.kinds import ALL, FOOT, HIP, SETS
from leg_wear_monitor.studies.leg_tasks import (
    DEAD_POINT,
    OPEN,
    STEP,
    TRANSMISSION,
    draw_leg,
    rejection,
    run_ensemble,
)
from leg_wear_monitor.studies.paper import CLAIMS, difference, greatest, least, log_ratio
from leg_wear_monitor.studies.plan import DEPTH, ERRORS, Estimate, Point, largest_error, of_joint
from leg_wear_monitor.studies.results import FAILS, HOLDS, UNDECIDED, decide, evaluate, holm, load_results


@pytest.fixture(scope="module")
def settings(tiny):
    """Two legs, of which the first one has no assembly; a few cycles."""
    return tiny("legs", legs=2, draw_seed=8)


@pytest.fixture(scope="module")
def directory(settings, tmp_path_factory):
    out = tmp_path_factory.mktemp("legs")
    run_study("legs", settings, out)
    return out


@pytest.fixture(scope="module")
def results(directory):
    return load_results(directory)


def test_the_leg_with_factors_one_has_the_numbers_of_the_study_location(results, tiny):
    point, leg = results.of("leg")[0]
    assert point.settings["leg"] == 0
    assert (leg["length_factor"] == 1.0).all() and (leg["mass_factor"] == 1.0).all()
    (hip,) = tiny("location", sets=[list(HIP)]).points()
    arrays = run_ensemble(load_mechanism(), hip.settings)
    for name in ERRORS:
        expected = largest_error(arrays, name).mean
        assert leg[f"set0_error_{name}"].mean() == pytest.approx(expected, rel=1e-12)
    for k, joint in enumerate(HIP):
        for name in ("wear_depth_m_per_cycle", "peak_force_n"):
            expected = of_joint(arrays, name, joint).mean
            assert leg[f"set0_{name}"][:, k].mean() == pytest.approx(expected, rel=1e-12)


@pytest.mark.plain
def test_a_leg_depends_on_its_seed_and_number_alone(settings):
    leg = load_mechanism()
    drawn, again = ([draw_leg(leg, point.settings) for point in settings.points()[1:]] for _ in range(2))
    for one, other in zip(drawn, again, strict=True):
        assert (one.length == other.length).all() and (one.mass == other.mass).all()
    changed = draw_leg(leg, settings.points()[1].settings | {"draw_seed": 2})
    for other in (drawn[1], changed):
        assert (drawn[0].length != other.length).any()


@pytest.mark.plain
def test_factors_are_within_their_tolerances_and_reach_the_bodies(settings):
    leg = load_mechanism()
    for point in settings.points()[1:]:
        drawn = draw_leg(leg, point.settings)
        assert (np.abs(drawn.length - 1.0) <= 0.1).all() and (np.abs(drawn.mass - 1.0) <= 0.3).all()
        assert np.ptp(drawn.length) > 0.0 and np.ptp(drawn.mass) > 0.0
        thigh, was = drawn.mechanism.bodies["thigh"], leg.bodies["thigh"]
        assert thigh.mass == pytest.approx(drawn.mass[1] * was.mass)
        assert thigh.points["G"] == pytest.approx([drawn.length[2] * x for x in was.points["G"]])
        ground = drawn.mechanism.ground.points["E"]
        assert ground == pytest.approx([drawn.length[0] * x for x in leg.ground.points["E"]])


def scaled(leg, **factors):
    bodies = {
        name: attrs.evolve(body, points={p: (f * x, f * y) for p, (x, y) in body.points.items()})
        for name, body in leg.bodies.items()
        for f in (factors.get(name, 1.0),)
    }
    return attrs.evolve(leg, bodies=bodies)


@pytest.mark.plain
@pytest.mark.parametrize(
    ("factors", "reason"),
    [
        ({}, ""),
        ({"crank": 1.02}, ""),
        ({"tendon": 1.5}, OPEN),
        ({"crank": 1.3}, DEAD_POINT),
        ({"crank": 0.4}, STEP),
        ({"crank": 1.183}, TRANSMISSION),
    ],
)
def test_legs_that_do_not_walk_are_rejected_with_the_reason(factors, reason):
    leg = load_mechanism()
    assert rejection(scaled(leg, **factors), leg) == reason


def test_what_is_rejected_for_a_dead_point_cannot_turn():
    with pytest.raises(AssemblyError, match="dead point"):
        one_cycle(build_linkage(scaled(load_mechanism(), crank=1.3)), 72, 1.0)


@pytest.mark.plain
def test_an_effect_has_sign_size_and_error_of_its_samples():
    chance = np.random.default_rng(1)
    x, y = 3.0 + 0.3 * chance.standard_normal((2, 4000, 6))
    effects = [log_ratio(2.0 * a, b, False) for a, b in zip(x, y, strict=True)]
    values, errors = (np.array([getattr(each, name) for each in effects]) for name in ("value", "error"))
    assert values.mean() == pytest.approx(np.log(2.0), abs=0.01)
    assert np.sqrt((errors**2).mean()) == pytest.approx(values.std(), rel=0.05)
    same = difference(x[0] + 1.0, x[0], True)
    assert (same.value, same.error) == (pytest.approx(1.0), pytest.approx(0.0, abs=1e-12))
    assert least([Estimate(1.0, 0.1), Estimate(0.5, 0.01)]) == Estimate(0.5, 0.01)
    assert greatest([Estimate(1.0, 0.1), Estimate(0.5, 0.01)]) == Estimate(1.0, 0.1)


@pytest.mark.plain
def test_a_claim_without_effect_is_undecided_and_rarely_decided():
    chance = np.random.default_rng(2)
    same = [log_ratio(*chance.lognormal(0.0, 0.1, (2, 6)), paired=True) for _ in range(4000)]
    states = [decide(each, runs=6) for each in same]
    assert states.count(UNDECIDED) / len(states) == pytest.approx(0.95, abs=0.015)
    assert decide(Estimate(0.5, 0.1), 6) == HOLDS
    assert decide(Estimate(-0.5, 0.1), 6) == FAILS
    assert decide(Estimate(0.0, 0.0), 6) == UNDECIDED


@pytest.mark.plain
def test_probabilities_are_corrected_as_by_holm():
    p = np.array([[0.01, 0.04], [0.03, 0.005]])
    assert holm(p) == pytest.approx(np.array([[0.03, 0.06], [0.06, 0.02]]))


def invented(count, scatter=1.0e-3):
    """Legs of which the first factor alone decides how deep J wears beside I: deeper where it is above 1."""
    chance, found = np.random.default_rng(3), []
    for number in range(count + 1):
        length = np.ones(3) if number == 0 else 1.0 + 0.1 * chance.uniform(-1.0, 1.0, 3)
        leg = {"bodies": np.array(["ground", "crank", "foot"]), "length_factor": length}
        leg |= {"mass_factor": 1.0 + 0.3 * chance.uniform(-1.0, 1.0, 2), "rejected": np.array("")}
        for i, joints in enumerate(SETS):
            for name in ERRORS:
                leg[f"set{i}_error_{name}"], leg[f"set{i}_ideal_range_{name}"] = np.ones(4), np.array(1.0)
            for name in ("wear_depth_m_per_cycle", "peak_force_n", "p99_force_n", "impacts", "zone_deg",
                         "zone_centre_deg", "repeats_contact_force"):  # fmt: skip
                leg[f"set{i}_{name}"] = 1.0 + scatter * chance.standard_normal((4, len(joints)))
        leg["set2_wear_depth_m_per_cycle"][:, 1] *= length[0]
        settings = {"leg": number, "runs": 4}
        found.append((Point(label=str(number), task="leg", settings=settings), leg))
    return found


@pytest.mark.plain
@pytest.mark.parametrize(
    ("alone", "with_five", "holds"), [(359.0, 3.0, True), (3.0, 359.0, True), (355.0, 5.5, False)]
)
def test_a_zone_stays_if_its_middle_moves_by_less_than_half_its_width(alone, with_five, holds):
    (_, leg), *_ = invented(0)
    for where, middle in ((HIP, alone), (ALL, with_five)):
        at = f"set{SETS.index(where)}_zone"
        leg[f"{at}_deg"][:, 1], leg[f"{at}_centre_deg"][:, 1] = 10.0, middle
    (stays,) = (claim for claim in CLAIMS if claim.key == "b_stays")
    assert (stays.measure(leg).value > 0.0) == holds


@pytest.mark.plain
def test_several_clearances_are_said_to_make_impacts_stronger_and_ours_contradict_at_the_hip():
    """The paper's 7.1 and 7.2, the right way round: forces as of our leg, alone and with five."""
    (_, leg), *_ = invented(0, scatter=0.0)
    forces = {
        HIP: (1676.0, 757.0),
        ("G",): (557.0,),
        FOOT: (46.0, 10.0),
        ALL: (947.0, 530.0, 499.0, 152.0, 38.0),
    }
    for where, values in forces.items():
        leg[f"set{SETS.index(where)}_p99_force_n"] = np.tile(values, (4, 1))
    signs = {claim.key: claim.measure(leg).value > 0.0 for claim in CLAIMS if claim.key.endswith("harder")}
    assert signs == {
        "j_harder": False, "a_harder": False, "b_harder": False, "g_harder": False, "foot_harder": True
    }  # fmt: skip
    leg[f"set{SETS.index(ALL)}_p99_force_n"][:, ALL.index("I")] = 40.0  # a claim on I and J is one on both
    (both,) = (claim for claim in CLAIMS if claim.key == "foot_harder")
    assert both.measure(leg).value < 0.0


@pytest.fixture(scope="module")
def sixty():
    """Sixty legs that walk, and one that has no assembly."""
    rejected = Point(label="x", task="leg", settings={"leg": 99, "runs": 4}), {"rejected": np.array(OPEN)}
    return [*invented(60), rejected]


@pytest.fixture(scope="module")
def evaluated(sixty):
    return evaluate(sixty)


def test_fractions_count_legs_and_what_decides_is_found(sixty, evaluated):
    by_key = {result.claim.key: result for result in evaluated.claims}
    deeper = by_key["j_deeper"]
    longer = np.array([leg["length_factor"][0] for _, leg in sixty[1:-1]])
    assert (evaluated.legs, evaluated.rejected) == (60, {OPEN: 1})
    assert deeper.count(HOLDS) == pytest.approx((longer > 1.0).sum(), abs=3)
    assert deeper.count(HOLDS) + deeper.count(FAILS) + deeper.count(UNDECIDED) == 60
    assert deeper.interval[0] < deeper.fraction < deeper.interval[1]
    assert [one.factor for one in deeper.influences] == ["length of ground"]
    assert deeper.influences[0].rank_correlation > 0.95
    assert {key for key, result in by_key.items() if result.influences} == {"j_deeper", "j_falls"}
    assert by_key["j_harder"].count(UNDECIDED) > 50


def test_the_page_has_a_row_for_every_claim_and_a_picture_of_what_decides(evaluated):
    rows = {row[1]: row for row in claim_table(evaluated).rows}
    assert list(rows) == [claim.text for claim in CLAIMS]
    deeper = next(result for result in evaluated.claims if result.claim.key == "j_deeper")
    assert rows["J wears deeper than I"][2:5] == [
        str(deeper.count(state)) for state in (HOLDS, FAILS, UNDECIDED)
    ]
    assert rows["J wears deeper than I"][-1].startswith("length of ground (+1.00")
    (picture, falls) = influence_gallery(evaluated).pictures
    assert picture.alt.startswith("J wears deeper than I: over the length of ground")
    assert picture.image != falls.image


def test_claims_are_json_and_have_a_state_for_every_leg(results):
    claims = results.claims()
    plain = json.loads(json.dumps(claims.to_dict(), allow_nan=False))
    drawn = [leg for _, leg in results.of("leg")[1:]]
    assert claims.legs + sum(claims.rejected.values()) == len(drawn) == 2
    assert [each["claim"] for each in plain["claims"]] == [claim.key for claim in CLAIMS]
    assert all(each["holds"] + each["fails"] + each["undecided"] == claims.legs for each in plain["claims"])
    assert {each["file_leg"]["state"] for each in plain["claims"]} <= {HOLDS, FAILS, UNDECIDED}


def test_the_claims_are_written_beside_the_page(directory, results, unpainted):
    assert write_study_page(directory) == 0
    assert json.loads((directory / "claims.json").read_text()) == results.claims().to_dict()
    sentence = "Of 2 drawn legs 1 walk; rejected: no assembly near that of the file 1."
    assert sentence in (directory / "report.html").read_text()


def test_the_file_s_leg_wears_deeper_at_a_than_at_b(results):
    """As docs/appendix/study.md has it: 68 against 48 pm a cycle with the hip alone."""
    (_, leg), claims = results.of("leg")[0], {one.claim.key: one for one in results.claims().claims}
    depth = leg[f"set{SETS.index(HIP)}_wear_depth_m_per_cycle"].mean(axis=0)
    assert claims["a_shallow"].file_leg.value == pytest.approx(np.log(depth[1] / depth[0]))
    assert claims["a_shallow"].file_leg.value < 0.0


def test_wear_that_is_not_counted_decides_nothing(results):
    """Without a wear coefficient of A, it is not the joint that wears least, nor in the widest zone."""
    leg = dict(results.of("leg")[0][1])
    for i, joints in enumerate(SETS):
        if "A" in joints:
            for name, value in ((DEPTH, 0.0), ("zone_deg", 360.0), ("zone_centre_deg", 180.0)):
                leg[f"set{i}_{name}"] = leg[f"set{i}_{name}"].copy()
                leg[f"set{i}_{name}"][:, joints.index("A")] = value
    effects = {claim.key: claim.measure(leg) for claim in CLAIMS}
    for key in ("a_shallow", "b_zone", "a_worse", "a_wide"):
        assert decide(effects[key], runs=2) == UNDECIDED, key
    assert effects["a_worst"].value <= 0.0


@pytest.mark.plain
def test_without_scipy_the_study_does_not_begin(settings, tmp_path, monkeypatch):
    monkeypatch.setattr(kinds, "find_spec", lambda _name: None)
    with pytest.raises(ConfigError, match="needs scipy, the extra 'studies'"):
        run_study("legs", settings, tmp_path / "out")
    assert not (tmp_path / "out").exists()
