"""The fleet at a glance: one entry per leg, the worst leg first; its files, and tables for Python."""

import csv
import io
import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs

from leg_wear_monitor.configuration import part_document
from leg_wear_monitor.configuration.strict import structure_of_version
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.files import data_frame, json_text, write_whole
from leg_wear_monitor.fleet.description import fleet_directory
from leg_wear_monitor.fleet.recordings import read_lines
from leg_wear_monitor.monitor.alarms import ADVICE, time_words
from leg_wear_monitor.monitor.verdict.verdict import how_soon
from leg_wear_monitor.state import JointClearance, LegState, LifeHours, State

if TYPE_CHECKING:
    import pandas as pd

SCHEMA_VERSION = 2
"""Version of the JSON; counts up when a field is renamed, removed or means something else."""

FILE, TABLE = "fleet.json", "fleet.csv"
UNKNOWN = "unknown"
"""State of a leg without a recording in its ledger."""


def leg_directory(out: Path, leg: str) -> Path:
    """Directory of the files of one leg."""
    return out / "legs" / leg


@attrs.frozen(kw_only=True)
class LegOverview:
    """One leg.

    Attributes
    ----------
    id : str
        Name of the leg.
    state : LegState or None
        State at the end of the last recording, or after a later entry of an operator; None before the first.
    recordings : int
        Recordings that the description names now.
    counted : int
        Number of these recordings whose wear is in the ledger.
    last_recording : str
        The recording with the latest end.
    last_ns : int
        Last stamp of this recording [ns]; 0 without a recording.
    faults : tuple of str
        Why the leg could not be updated, and recordings that were not modelled completely; the first ten.
    """

    id: str
    state: LegState | None = None
    recordings: int = 0
    counted: int = 0
    last_recording: str = ""
    last_ns: int = 0
    faults: tuple[str, ...] = ()

    @property
    def word(self) -> str:
        """State of the verdict; ``unknown`` before the first recording."""
        return self.state.verdict.state.value if self.state else UNKNOWN

    @property
    def how_soon(self) -> str:
        """The deadline of the leg's verdict, as on the page of the leg itself."""
        if self.state is None:
            return "record its gait, then update the fleet"
        return how_soon(self.state)

    @property
    def used_fraction(self) -> dict[str, float]:
        """Fraction of each joint's clearance, from new to limit, that is used up; joints with a value."""
        clearances = self.state.clearances if self.state else {}
        return {
            joint: (one.best_estimate_m - one.new_m) / (one.limit_m - one.new_m)
            for joint, one in clearances.items()
            if one.best_estimate_m is not None
        }

    @property
    def worst_joint(self) -> str:
        """The joint whose clearance is the largest fraction of its limit; empty if none is known."""
        used = self.used_fraction
        return max(used, key=lambda joint: used[joint], default="")

    @property
    def life(self) -> LifeHours | None:
        """Remaining life of the leg; if only the ledger is known, of the joint with the shortest life."""
        lives = self.state.life if self.state else {}
        known = [life for life in lives.values() if life]
        return lives.get("leg") or min(known, key=lambda life: life.p10_h, default=None)

    @property
    def urgency(self) -> tuple[float, float, float, str]:
        """Key that sorts legs, the worst first: by state, remaining life, and clearance."""
        state = self.state.verdict.state if self.state else State.NOT_MONITORED
        life, used = self.life, self.used_fraction.values()
        return -state.severity, life.p10_h if life else math.inf, -max(used, default=0.0), self.id

    @property
    def row(self) -> dict[str, Any]:
        """The leg as a row of a table; None for unknown values."""
        verdict = self.state.verdict if self.state else None
        joint = self.worst_joint
        clearance: JointClearance | None = self.state.clearances[joint] if self.state and joint else None
        life = self.life
        return {
            "leg": self.id,
            "state": self.word,
            "joints": " ".join(verdict.joints) if verdict else "",
            "fault_code": verdict.fault_code if verdict else "",
            "why": verdict.why if verdict else "",
            "do": verdict.do if verdict else "",
            "how_soon": self.how_soon,
            "worst_joint": joint,
            "clearance_m": clearance.best_estimate_m if clearance else None,
            "limit_m": clearance.limit_m if clearance else None,
            "life_p10_h": life.p10_h if life else None,
            "life_p50_h": life.p50_h if life else None,
            "life_p90_h": life.p90_h if life else None,
            "last_recording": self.last_recording,
            "last_time": time_words(self.last_ns) if self.last_ns else "",
            "recordings": self.recordings,
            "counted": self.counted,
            "faults": "; ".join(self.faults),
        }


@attrs.frozen(kw_only=True)
class FleetOverview:
    """The fleet; its page contains nothing else.

    Attributes
    ----------
    counts : dict of str to int
        Number of legs in each state, from the mildest to the most severe, and of ``unknown`` legs.
    legs : tuple of LegOverview
        The worst leg first.
    advice : str
        Limits of the results.
    """

    counts: dict[str, int]
    legs: tuple[LegOverview, ...]
    advice: str

    def leg(self, name: str) -> LegOverview:
        """A leg by its id."""
        return {leg.id: leg for leg in self.legs}[name]

    def to_dict(self) -> dict[str, Any]:
        """Plain object: the content of ``fleet.json``; null for unknown values."""
        legs = [
            {**part_document(attrs.evolve(leg, state=None)), "state": _without_version(leg.state)}
            for leg in self.legs
        ]
        return {"schema_version": SCHEMA_VERSION, **part_document(attrs.evolve(self, legs=())), "legs": legs}

    def to_json(self) -> str:
        """Text of ``fleet.json``."""
        return json_text(self.to_dict())

    def to_csv(self) -> str:
        """Text of ``fleet.csv``: one row per leg, the worst leg first.

        An apostrophe marks texts that a spreadsheet would compute, such as ``=HYPERLINK(...)``.
        """
        text = io.StringIO()
        rows = [{name: _as_text(value) for name, value in leg.row.items()} for leg in self.legs]
        writer = csv.DictWriter(text, fieldnames=list(LegOverview(id="").row), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        return text.getvalue()

    def to_pandas(self) -> "pd.DataFrame":
        """The same rows as a data frame; requires pandas."""
        return _frame([leg.row for leg in self.legs], list(LegOverview(id="").row))


def _as_text(value: Any) -> Any:
    is_formula = isinstance(value, str) and value.startswith(("=", "+", "-", "@"))
    return f"'{value}" if is_formula else value


def _without_version(state: LegState | None) -> dict[str, Any] | None:
    if state is None:
        return None
    return {name: value for name, value in state.to_dict().items() if name != "schema_version"}


def overview_of(legs: Iterable[LegOverview]) -> FleetOverview:
    """The fleet of some legs."""
    ordered = tuple(sorted(legs, key=lambda leg: leg.urgency))
    words = [leg.word for leg in ordered]
    counts = {word: words.count(word) for word in (*(each.value for each in State), UNKNOWN)}
    return FleetOverview(counts=counts, legs=ordered, advice=ADVICE)


def write_overview(out: Path, overview: FleetOverview) -> None:
    """Write ``fleet.json`` and ``fleet.csv``, each whole or not at all."""
    write_whole(out / FILE, overview.to_json().encode())
    write_whole(out / TABLE, overview.to_csv().encode())


def load_overview(path: Path) -> FleetOverview:
    """Read the overview in the directory of a fleet.

    Raises
    ------
    ConfigError
        If there is none, or it has a different version; the message names the key at fault.
    """
    place = path / FILE
    try:
        record = json.loads(place.read_bytes())
    except OSError as error:
        raise ConfigError(str(place), "", f"cannot be read: {error.strerror}; run fleet update") from error
    except ValueError as error:
        raise ConfigError(str(place), "", "is not JSON; run fleet update again") from error
    return structure_of_version(record, FleetOverview, SCHEMA_VERSION, str(place), "run fleet update again")


class Fleet:
    """Results of a fleet that ``leg-wear-monitor fleet update`` maintains; its tables require pandas.

    Parameters
    ----------
    path : str or pathlib.Path
        Directory of the fleet, or its description ``fleet.yaml``.

    Attributes
    ----------
    path : pathlib.Path
        Directory of the fleet.
    overview : FleetOverview
        The fleet at a glance, as in ``fleet.json``.

    Raises
    ------
    ConfigError
        If the directory contains no fleet.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> fleet = lw.Fleet("fleet/")  # doctest: +SKIP
    >>> fleet.overview.counts["stop"]  # doctest: +SKIP
    1
    >>> fleet.to_pandas()[["leg", "state", "worst_joint", "clearance_m"]]  # doctest: +SKIP
    """

    def __init__(self, path: str | Path) -> None:
        self.path = fleet_directory(path)
        self.overview: FleetOverview = load_overview(self.path)

    def to_pandas(self) -> "pd.DataFrame":
        """Table with one row per leg, the worst leg first, as in ``fleet.csv``."""
        return self.overview.to_pandas()

    def recordings(self) -> "pd.DataFrame":
        """Table with one row per recording: whether its wear was modelled, and if not, the reason."""
        rows = [
            {"leg": leg.id, **attrs.asdict(one), "findings": "; ".join(one.findings)}
            for leg in self.overview.legs
            for one in read_lines(leg_directory(self.path, leg.id)).values()
        ]
        return _frame(rows, ["leg"])


def _frame(rows: list[dict[str, Any]], columns: list[str]) -> "pd.DataFrame":
    names = list(rows[0]) if rows else columns
    return data_frame({name: [row[name] for row in rows] for name in names})
