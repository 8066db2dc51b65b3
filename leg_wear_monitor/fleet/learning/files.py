"""What a fleet has learned, as files: ``learning.json``, and for each leg the file of ``forecast.priors``."""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs

from leg_wear_monitor.fleet.directory.leg_directory import LegDirectory
from leg_wear_monitor.fleet.learning.learn import LearnedPair, LearnedPart
from leg_wear_monitor.fleet.learning.part import Part
from leg_wear_monitor.json_text import json_text
from leg_wear_monitor.monitor.forecast.coefficient_prior import (
    SCHEMA_VERSION,
    CoefficientPrior,
    LearnedCoefficient,
    LearnedJoint,
    LearnedPriors,
)
from leg_wear_monitor.whole_file import write_whole

LEARNING, LEARNING_VERSION = "learning.json", 1


def priors_of(leg: str, parts: Sequence[Part], learned: Mapping[str, LearnedPair]) -> LearnedPriors:
    """Priors of a leg's joints; joints of pairs of which nothing is measured are left out.

    Parameters
    ----------
    leg : str
    parts : sequence of Part
        Of the fleet, or of this leg.
    learned : mapping of str to LearnedPair
        By material pair, from `learn`.
    """
    joints = {}
    for part in sorted(parts, key=lambda part: part.key):
        pair = learned.get(part.pair)
        if part.leg != leg or not part.is_present or pair is None:
            continue
        own = {each.part.key: each.prior for each in pair.measured}
        present = own.get(part.key) or pair.lots.get(part.lot, pair.new_lot)
        joints[part.joint] = LearnedJoint(
            replaced_ns=part.replaced_ns,
            present=_coefficient(part, present),
            next=_coefficient(part, pair.new_lot),
        )
    return LearnedPriors(schema_version=SCHEMA_VERSION, leg=leg, joints=joints)


def write_learning(
    directory: Path, parts: Sequence[Part], learned: Mapping[str, LearnedPair], measured: str = ""
) -> dict[str, Path]:
    """Write ``learning.json``, and ``priors/LEG.json`` for each leg; the same content for the same parts.

    Parameters
    ----------
    directory : pathlib.Path
        Of the fleet's results; it exists.
    parts : sequence of Part
    learned : mapping of str to LearnedPair
    measured : str
        Digest of the measurements, by which the next update knows whether there are others.

    Returns
    -------
    dict of str to pathlib.Path
        The file of priors of each leg.

    Raises
    ------
    ConfigError
        If the disk does not take a file.
    """
    written = {}
    for leg in sorted({part.leg for part in parts}):
        written[leg] = LegDirectory(directory, leg).priors
        text = json_text(attrs.asdict(priors_of(leg, parts, learned)))
        write_whole(written[leg], text.encode())
    # last: it says that all of this is learned
    write_whole(directory / LEARNING, json_text(document(learned, measured)).encode())
    return written


def learned_from(directory: Path) -> str:
    """Digest of the measurements that a fleet has learned from; empty if it has not learned yet."""
    try:
        record = json.loads((directory / LEARNING).read_bytes())
    except (OSError, ValueError):  # none yet, or damaged: it is learned again
        return ""
    return str(record.get("measured", "")) if isinstance(record, dict) else ""


def document(learned: Mapping[str, LearnedPair], measured: str = "") -> dict[str, Any]:
    """Content of ``learning.json``."""
    return {
        "schema_version": LEARNING_VERSION,
        "measured": measured,
        "pairs": {name: _pair(learned[name]) for name in sorted(learned)},
    }


def _pair(pair: LearnedPair) -> dict[str, Any]:
    return {
        "prior_sigma": pair.prior_sigma,
        "lot_sigma": pair.lot_sigma,
        "part_sigma": pair.part_sigma,
        "new_lot": attrs.asdict(pair.new_lot),
        "lots": {lot: attrs.asdict(pair.lots[lot]) for lot in sorted(pair.lots)},
        "parts": [_part(each) for each in pair.measured],
    }


def _part(learned: LearnedPart) -> dict[str, Any]:
    part = learned.part
    return {
        "leg": part.leg,
        "joint": part.joint,
        "replaced_ns": part.replaced_ns,
        "lot": part.lot,
        "factor": part.factor,
        "factor_sigma": part.precision**-0.5,
        "prior": attrs.asdict(learned.prior),
        "residual": learned.residual,
        "counts": learned.counts,
        "finding": learned.finding,
    }


def _coefficient(part: Part, prior: CoefficientPrior) -> LearnedCoefficient:
    return LearnedCoefficient(
        wear_coefficient_per_pa=part.nominal_per_pa * math.exp(prior.mean),
        sigma=prior.sigma,
        basis=prior.basis,
    )
