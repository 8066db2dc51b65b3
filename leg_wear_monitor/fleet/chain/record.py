"""What is kept of one recording of a leg."""

import math
from enum import Enum
from typing import TYPE_CHECKING, Any

import attrs

from leg_wear_monitor.errors import printable
from leg_wear_monitor.monitor.forecast.forecast import ForecastBasis
from leg_wear_monitor.monitor.reports import Lost
from leg_wear_monitor.monitor.verdict.verdict import Verdict
from leg_wear_monitor.playback.condition import clearances, life
from leg_wear_monitor.playback.result.condition import JointClearance, LifeHours
from leg_wear_monitor.playback.result.document import part_document

if TYPE_CHECKING:
    from leg_wear_monitor.playback.summary import ReplayResult

_MOST_FINDINGS = 20


class Outcome(Enum):
    """What became of a recording."""

    COUNTED = "counted"
    ALREADY_COUNTED = "already_counted"
    """All of its time was in the ledger, from other recordings."""
    NO_GAIT = "no_gait"
    """No gait cycle in it fits the leg; nothing is counted."""
    UNREADABLE = "unreadable"
    """Nothing in it can be read; nothing is counted."""

    @property
    def is_final(self) -> bool:
        """Whether other settings of the leg would change nothing."""
        return self in (Outcome.COUNTED, Outcome.ALREADY_COUNTED)


@attrs.frozen(kw_only=True)
class RecordingRecord:
    """One recording of a leg.

    Attributes
    ----------
    key : str
        Digest of its content.
    file : str
        Its name when it was counted.
    outcome : Outcome
    settings : str
        Digest of the leg's settings; what was not counted is tried again with others.
    begin_ns, end_ns : int
        First and last stamp [ns]; 0 if there are none.
    duration_s : float
        Time between them [s].
    cycles : int
        Gait cycles that were counted from it.
    is_partial : bool
        Whether recorded data are lost or may be wrong.
    is_late : bool
        Whether a later recording had been counted before it.
    findings : tuple of str
        Faults and remarks; the first twenty.
    lost : Lost or None
        Samples and time that were not used; None if nothing was replayed.
    verdict : Verdict or None
        Verdict at its end; None unless it was counted, like the next two.
    clearances : dict of str to JointClearance
    life : dict of str to LifeHours or None
        Remaining life of each joint, and of the ``leg``.
    basis : ForecastBasis or None
        What the forecast rests on; None without one.
    knows : str
        Digest of the measurements and priors in it; with others, the forecast is made again.
    """

    key: str
    file: str
    outcome: Outcome
    settings: str
    begin_ns: int = 0
    end_ns: int = 0
    duration_s: float = 0.0
    cycles: int = 0
    is_partial: bool = False
    is_late: bool = False
    findings: tuple[str, ...] = ()
    lost: Lost | None = None
    verdict: Verdict | None = None
    clearances: dict[str, JointClearance] = attrs.Factory(dict)
    life: dict[str, LifeHours | None] = attrs.Factory(dict)
    basis: ForecastBasis | None = None
    knows: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Plain object, as its line in the file has it."""
        return dict(part_document(self))

    @property
    def is_sound(self) -> bool:
        """Whether nothing of it is lost."""
        return not self.is_partial and self.outcome.is_final


def unreadable(key: str, file: str, settings: str, fault: str) -> RecordingRecord:
    """Record of a recording that cannot be read."""
    return RecordingRecord(
        key=key,
        file=file,
        settings=settings,
        outcome=Outcome.UNREADABLE,
        is_partial=True,
        findings=(printable(fault),),
    )


def record_of(
    result: "ReplayResult", *, key: str, file: str, settings: str, is_late: bool, knows: str = ""
) -> RecordingRecord:
    """Record of a replay; `ReplayResult.findings` must be complete."""
    texts = [printable(one.text) for one in result.findings]
    about: dict[str, Any] = {
        "key": key,
        "file": file,
        "settings": settings,
        "begin_ns": result.begin_ns,
        "end_ns": result.end_ns,
        "duration_s": result.duration_s,
        "is_partial": result.is_partial,
        "is_late": is_late,
        "lost": result.monitor.lost,
    }
    if result.is_unusable:
        texts.insert(0, f"no gait cycle fits this leg: {printable(result.evidence.missing())}")
        return RecordingRecord(outcome=Outcome.NO_GAIT, findings=tuple(texts[:_MOST_FINDINGS]), **about)
    if result.monitor.is_all_counted:
        texts.insert(
            0, "all of its time is that of recordings before it; if it is another walk, its clock is wrong"
        )
        return RecordingRecord(
            outcome=Outcome.ALREADY_COUNTED, findings=tuple(texts[:_MOST_FINDINGS]), **about
        )
    verdict, basis = result.monitor.verdict.verdict, result.monitor.forecast_basis
    return RecordingRecord(
        outcome=Outcome.COUNTED,
        cycles=len(result.history),
        findings=tuple(texts[:_MOST_FINDINGS]),
        verdict=verdict,
        clearances=clearances(result),
        life=life(result, verdict),
        basis=basis if basis and math.isfinite(basis.cycle_s) else None,
        knows=knows,
        **about,
    )
