"""From measurements to priors of legs: parts, lots, files, and what the forecast reads of them."""

import json

import attrs
import pytest
from ledger_contents import measured

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.fleet.learning import learn, pair_of, parts_of
from leg_wear_monitor.fleet.renew import priors_of, write_learning
from leg_wear_monitor.monitor.config.sections import Forecasting
from leg_wear_monitor.monitor.forecast.wear_coefficients import (
    ClearanceAtWear,
    estimate_coefficient,
    prior_source,
    usual_prior,
)

pytestmark = pytest.mark.plain

MECHANISM, SETTINGS, NEW_M = load_mechanism("bionic_leg"), Forecasting(), 3.0e-4
USUAL = usual_prior(SETTINGS, MECHANISM.clearances["A"])


def measurement(joint="A", factor=2.0, **own):
    """A measured clearance after 60 µm of counted wear."""
    return measured(joint=joint, clearance_m=NEW_M + factor * 6.0e-5, **own)


def parts(leg, *measurements, replaced_ns=None, **lots):
    return parts_of(leg, MECHANISM, SETTINGS, measurements, replaced_ns or {}, **lots)


def test_every_joint_has_its_present_part_and_those_that_were_measured():
    found = parts("left", measurement(), measurement(replaced_ns=5), replaced_ns={"A": 7, "B": 3},
                  lot="2026-03")  # fmt: skip
    of = {each.key: each for each in found}
    assert len(found) == 5 + 2
    assert [of["left", "A", when].lot for when in (0, 5, 7)] == ["2026-03", "", ""]
    assert [of["left", "A", when].is_present for when in (0, 5, 7)] == [False, False, True]
    assert (of["left", "B", 3].lot, of["left", "G", 0].lot) == ("", "2026-03")
    assert {each.pair for each in found} == {pair_of(MECHANISM.clearances["A"])}
    assert of["left", "A", 5].factor == pytest.approx(2.0)
    assert of["left", "A", 7].precision == 0.0


def test_measurements_that_do_not_count_are_no_evidence():
    (found, *_) = parts("left", measurement(counts=False), measurement(withdrawn_ns=4))
    assert found.precision == 0.0


def test_a_joint_that_does_not_wear_is_left_out():
    still = attrs.evolve(MECHANISM.clearances["A"], wear_coefficient=(0.0, 0.0))
    leg = attrs.evolve(MECHANISM, clearances=MECHANISM.clearances | {"A": still})
    assert [each.joint for each in parts_of("left", leg, SETTINGS, (), {})] == ["B", "G", "I", "J"]


@pytest.fixture
def fleet():
    """Three measured legs of a lot, and one that is not measured."""
    measured = [parts(f"leg {i}", measurement(factor=1.8 + 0.2 * i), lot="2026-03") for i in range(3)]
    return [part for own in (*measured, parts("new", lot="2026-03")) for part in own]


def test_a_measured_leg_gets_what_all_legs_say_together(fleet, tmp_path):
    """Its prior is that of the others, so that its own measurement counts once."""
    written = write_learning(tmp_path, fleet, learn(fleet))
    prior = prior_source(MECHANISM, attrs.evolve(SETTINGS, priors=str(written["leg 0"]))).prior("A", 0)
    assert prior.basis == "2 parts of lot 2026-03"
    own = ClearanceAtWear(NEW_M + 1.8 * 6e-5, 2e-6, 6e-5)
    alone, together = (estimate_coefficient(SETTINGS, NEW_M, [own], each) for each in (None, prior))
    assert together.sigma < alone.sigma
    assert together.prior == prior


def test_a_leg_whose_own_part_alone_is_measured_keeps_the_configured_prior():
    alone = parts("left", measurement(), lot="2026-03")
    priors = priors_of("left", alone, learn(alone))
    assert priors.joints["A"].present.basis == USUAL.basis
    assert priors.joints["A"].present.sigma == USUAL.sigma
    assert priors.joints["B"].present.basis == "1 part of lot 2026-03"


def test_files_are_the_same_in_any_order(fleet, tmp_path):
    texts = []
    for name, order in (("one", fleet), ("other", fleet[::-1])):
        (tmp_path / name).mkdir()
        written = write_learning(tmp_path / name, order, learn(order))
        texts.append(
            [(tmp_path / name / "learning.json").read_text(), *(p.read_text() for p in written.values())]
        )
    assert texts[0] == texts[1]
    (pair,) = json.loads(texts[0][0])["pairs"].values()
    assert [each["leg"] for each in pair["parts"]] == ["leg 0", "leg 1", "leg 2"]
    assert pair["lots"]["2026-03"]["basis"] == "3 parts of lot 2026-03"
