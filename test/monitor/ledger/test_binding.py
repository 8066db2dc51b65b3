"""What a ledger is bound to: the worn parts, not what people call them."""

import json

import attrs
import numpy as np
import pytest

import leg_wear_monitor as lw
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.monitor.ledger.entry import fingerprint

pytestmark = pytest.mark.plain


def test_a_label_does_not_make_another_leg():
    leg = lw.load_mechanism("bionic_leg")
    named = {**leg.joints, "G": attrs.evolve(leg.joints["G"], label="Knie")}
    moved = {**leg.joints, "G": attrs.evolve(leg.joints["G"], bushing="foot")}
    assert fingerprint(attrs.evolve(leg, joints=named)) == fingerprint(leg)
    assert fingerprint(attrs.evolve(leg, joints=moved)) != fingerprint(leg)


def test_the_torque_reference_of_the_default_leg_is_of_this_leg():
    with np.load(share_directory() / "config" / "references" / "bionic_leg.npz") as reference:
        assert str(reference["fingerprint"]) == fingerprint(lw.load_mechanism("bionic_leg"))


def test_the_lives_of_the_default_leg_are_of_this_leg():
    lives = json.loads((share_directory() / "config" / "lives" / "bionic_leg.json").read_text())
    assert lives["fingerprint"] == fingerprint(lw.load_mechanism("bionic_leg"))
