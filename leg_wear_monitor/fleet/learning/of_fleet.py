"""Learning from the ledgers of a fleet, before an update or after it."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path

import attrs

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.fleet.description.fleet_description import FleetLeg
from leg_wear_monitor.fleet.directory.leg_directory import LegDirectory
from leg_wear_monitor.fleet.learning.files import write_learning
from leg_wear_monitor.fleet.learning.learn import LearnedPair, learn
from leg_wear_monitor.fleet.learning.part import Part, parts_of
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.ledger.file import copy_of, measurements_of
from leg_wear_monitor.monitor.ledger.ledger import Ledger, open_ledger


@attrs.frozen(kw_only=True)
class FleetLearning:
    """What a fleet has learned.

    Attributes
    ----------
    pairs : mapping of str to LearnedPair
        By material pair; empty if no clearance was measured.
    priors : mapping of str to pathlib.Path
        File for ``forecast.priors`` of each leg; empty if no ledger has ever had a measurement.
    findings : tuple of (str, str)
        The leg, and a line about a part that contradicts the others, or a ledger that cannot be read.
    """

    pairs: Mapping[str, LearnedPair]
    priors: Mapping[str, Path]
    findings: tuple[tuple[str, str], ...]


def learn_fleet(legs: Sequence[FleetLeg], out: Path) -> FleetLearning:
    """Learn from the measured clearances in the ledgers of a fleet, and write what was learned.

    Parameters
    ----------
    legs : sequence of FleetLeg
        In any order; the result is the same. A leg without a ledger has new parts.
    out : pathlib.Path
        Directory of the fleet, which exists.
    """
    ledgers = {leg.id: LegDirectory(out, leg.id).ledger for leg in legs}
    measured = measured_in(legs, out)
    if not measured:  # nobody ever measured: no ledger is copied
        return FleetLearning(pairs={}, priors=write_learning(out, (), {}), findings=())
    parts: list[Part] = []
    findings = []
    for leg in sorted(legs, key=lambda leg: leg.id):
        if leg.config.wear_acceleration != 1.0:
            if measurements_of(ledgers[leg.id]):
                findings.append((leg.id, "nothing is learned from it: its wear is accelerated"))
            continue
        try:
            parts += leg_parts(leg, ledgers[leg.id])
        except LegWearError as error:
            findings.append((leg.id, f"nothing is learned from it: {error}"))
    pairs = learn(parts)
    for pair in pairs.values():
        findings += [(each.part.leg, each.finding) for each in pair.measured if each.finding]
    return FleetLearning(
        pairs=pairs, priors=write_learning(out, parts, pairs, measured), findings=tuple(sorted(findings))
    )


def measured_in(legs: Sequence[FleetLeg], out: Path) -> str:
    """Digest of all that was ever measured in a fleet; empty if nothing was. No ledger is copied."""
    texts = [(leg.id, leg.lot, measurements_of(LegDirectory(out, leg.id).ledger)) for leg in legs]
    if not any(text for _, _, text in texts):
        return ""
    return hashlib.sha256(repr(sorted(texts)).encode()).hexdigest()[:20]


def leg_parts(leg: FleetLeg, path: Path) -> list[Part]:
    """Parts of a leg, with the measured clearances of its ledger if there is one; it is left unchanged.

    Raises
    ------
    LegWearError
        If the ledger cannot be read.
    """
    mechanism = fitted(load_mechanism(leg.config.mechanism), leg.config)
    if not path.exists():
        return parts_of(leg.id, mechanism, leg.config.forecast, (), {}, lot=leg.lot)
    with ledger_copy(mechanism, leg.config, path) as ledger:
        entry, measurements, corrections = ledger.entry, ledger.measurements, ledger.corrections
    replaced_ns = {wear.name: wear.replaced_ns for wear in entry.joints} if entry else {}
    known = leg.config.forecast, measurements, replaced_ns
    return parts_of(leg.id, mechanism, *known, lot=leg.lot, corrections=corrections)


@contextmanager
def ledger_copy(mechanism: Mechanism, config: MonitorConfig, path: Path) -> Iterator[Ledger]:
    """A ledger opened in a copy: it is left unchanged.

    Raises
    ------
    LegWearError
        If it cannot be read.
    """
    with copy_of(path) as copy:
        settings = attrs.evolve(config, ledger=attrs.evolve(config.ledger, path=str(copy)))
        ledger = open_ledger(mechanism, settings)
        if ledger is None:
            raise LegWearError(f"{path}: no ledger")
        with closing(ledger):
            yield ledger
