"""The update of a fleet: every recording that is not counted yet is replayed into the ledger of its leg.

Further parts: which recordings are complete while others are being recorded, the tables of an updated fleet
for Python (`Fleet`), and the check of a description before an update.
"""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs

from leg_wear_monitor.bags.bag import METADATA, find_files
from leg_wear_monitor.bags.budget import DEFAULT_MB
from leg_wear_monitor.bags.findings import RecordingError
from leg_wear_monitor.bags.mcap_layout import MAGIC
from leg_wear_monitor.bags.table_layout import PARQUET
from leg_wear_monitor.files import data_frame
from leg_wear_monitor.fleet.chain import Chain, Job, begin_of, state_of, words_of
from leg_wear_monitor.fleet.description import FleetDescription, FleetLeg, fleet_directory
from leg_wear_monitor.fleet.directory import (
    LegDirectory,
    arrow,
    locked,
    read_tables,
    table_of,
    write_table,
)
from leg_wear_monitor.fleet.overview import FleetOverview, load_overview, write_overview
from leg_wear_monitor.fleet.renew import is_renewal_due, learn_fleet, learned_from, measured_in, renew
from leg_wear_monitor.workers import results

if TYPE_CHECKING:
    import pandas as pd


# The update: jobs of all legs, which run in this process, in local processes or on a cluster.


_UNCOUNTED_OUTCOMES = ("no_gait", "already_counted")  # of a recording that was read

Report = Callable[[str, str], None]
"""Called with the id of a leg and a line about it."""


@attrs.frozen
class FleetUpdate:
    """Result of an update.

    Attributes
    ----------
    chains : tuple of Chain
        Results of the legs, in the order of the description.
    learned : tuple of (str, str)
        Findings of the learning: the leg, and a line about a measured clearance that it does not use.
    """

    chains: tuple[Chain, ...]
    learned: tuple[tuple[str, str], ...] = ()

    @property
    def counted(self) -> int:
        """Number of recordings that were counted."""
        return sum(line["outcome"] == "counted" for chain in self.chains for line in chain.new)

    @property
    def is_up_to_date(self) -> bool:
        """Whether there was nothing to do."""
        return not self.renewed and not any(
            chain.new or chain.copies or chain.refused or chain.fault for chain in self.chains
        )

    @property
    def renewed(self) -> int:
        """Number of legs without a new recording whose forecast was updated with a new measurement."""
        return sum(chain.is_renewed and not chain.fault for chain in self.chains)

    @property
    def with_new_settings(self) -> list[str]:
        """Legs whose forecast was made with other settings than the one before, such as another duty."""
        made = (
            chain
            for chain in self.chains
            if (chain.is_renewed and not chain.fault) or any(one["outcome"] == "counted" for one in chain.new)
        )
        return [chain.leg.id for chain in made if chain.has_new_settings]

    @property
    def findings(self) -> list[tuple[str, str]]:
        """Findings for operators: the leg, and a line about what is lost or was not done."""
        found = list(self.learned)
        for chain in self.chains:
            bad = [line for line in chain.new if line["is_partial"] or line["outcome"] in _UNCOUNTED_OUTCOMES]
            found += [(chain.leg.id, words_of(line)) for line in bad]
            found += [(chain.leg.id, text) for text in [*chain.refused, chain.fault] if text]
        return found


def update_fleet(
    fleet: FleetDescription,
    out: Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    memory_mb: float = DEFAULT_MB,
    sample: float | None = None,
    begin: Callable[[Sequence[Chain]], None] | None = None,
    progress: Callable[[float], None] | None = None,
    report: Report | None = None,
) -> FleetUpdate:
    """Count the recordings of a fleet that are not counted yet, those of a leg in the order of time.

    An interrupted update keeps every recording that is finished; the next update continues from there.

    Parameters
    ----------
    fleet : FleetDescription
    out : pathlib.Path
        Directory of the fleet.
    workers : int
        Number of local processes; 1 uses this process only. Results do not depend on it.
    scheduler : str, optional
        Address of a Dask scheduler whose workers count instead; they need the same files at the same paths.
    memory_mb : float
        Memory limit of reading in each process, as in `leg_wear_monitor.replay` [10⁶ bytes].
    sample : float, optional
        Fraction of the gait cycles that are followed, as in `leg_wear_monitor.replay`; without it, all.
    begin : callable, optional
        Called with all legs before the first job, if there is one; for example to compile.
    progress : callable, optional
        Called with the completed fraction of the work, 0 to 1.
    report : callable, optional
        Called with the id of a leg and a line, for each recording.

    Raises
    ------
    ConfigError
        If another process updates this directory, or it cannot be written to.
    LegWearError
        If pyarrow is not installed, or workers die repeatedly.
    """
    arrow()  # fails early if pyarrow is not installed
    out = out.absolute()
    with locked(out):
        legs = (attrs.evolve(leg, memory_mb=memory_mb, sample=sample) for leg in fleet.legs)
        work = _UpdateJobs([Chain(leg, out) for leg in legs], progress, report)
        scans = work.scans()
        if begin and (scans or work.is_due):
            begin(work.chains)
        # further jobs follow from the results of the first ones, in `done`
        jobs = scans or work.first_jobs()
        while jobs:
            by_key = {job.key: job for job in sorted(jobs, key=lambda job: -job.cost)}
            done = results({key: job.run for key, job in by_key.items()}, workers, scheduler)
            jobs = [following for key, result in done for following in work.done(by_key[key], result)]
        faults = {one.leg.id: next(filter(None, [one.fault, *one.refused]), "") for one in work.chains}
        write_overview(fleet, out, faults)
    return FleetUpdate(tuple(work.chains), work.learned)


class _UpdateJobs:
    """Jobs of an update, each with those that follow from its result.

    First, unknown recordings are scanned for their time and content. When all scans are done, the order of
    the recordings is known, and those of each leg are counted one after the other. A leg with a new
    measurement has its forecast updated at last.
    """

    def __init__(
        self, chains: list[Chain], progress: Callable[[float], None] | None, report: Report | None
    ) -> None:
        self.chains = chains
        self._by_leg = {chain.leg.id: chain for chain in chains}
        self._progress, self._report = progress or (lambda _fraction: None), report or (lambda *_: None)
        self._open_scans = 0
        self._total = 1
        self.learned: tuple[tuple[str, str], ...] = ()

    @property
    def is_due(self) -> bool:
        """Whether known recordings are not counted yet; valid after `scans`."""
        return any(chain.waiting for chain in self.chains)

    def scans(self) -> list[Job]:
        """Jobs that scan unknown recordings; without any, the counting is planned at once."""
        jobs = [job for job in (chain.begin() for chain in self.chains) if job is not None]
        self._open_scans = len(jobs)
        if not jobs:
            self._plan()
        return jobs

    def first_jobs(self) -> list[Job]:
        """The first job of each leg after the scans."""
        return [job for job in map(self._next_job, self.chains) if job is not None]

    def _next_job(self, chain: Chain) -> Job | None:
        """Job of the next recording of a leg; after the last one, of its forecast if that is due."""
        if chain.waiting or chain.fault or chain.is_renewed or not is_renewal_due(chain.directory):
            return chain.next_job()
        leg = attrs.evolve(chain.leg, recordings=())
        return Job(f"renew-{leg.id}", renew, (leg, chain.directory))

    def done(self, job: Job, result: Any) -> list[Job]:
        """Accept the result of a job, and return the jobs that follow from it."""
        chain = self._by_leg[job.arguments[0].id]
        if job.key.startswith("scan-"):
            chain.take(result)
            self._open_scans -= 1
            if self._open_scans:
                return []
            self._plan()
            return self.first_jobs()
        if job.key.startswith("renew-"):
            chain.is_renewed, chain.fault = True, result
            return []
        chain.done(result)
        self._report(chain.leg.id, result if isinstance(result, str) else words_of(result))
        left = sum(each.waiting_bytes for each in self.chains if not each.fault)
        self._progress(1.0 - left / self._total)
        following = self._next_job(chain)
        return [following] if following else []

    def _plan(self) -> None:
        """Queue the recordings of all legs, and learn from measured clearances if there is work."""
        for chain in self.chains:
            chain.plan()
        _refuse_shared(self.chains)
        for chain in self.chains:
            for line in chain.copies:
                self._report(chain.leg.id, line)
        self._total = max(1, sum(chain.waiting_bytes for chain in self.chains))
        out = self.chains[0].out
        if (
            self.is_due
            or measured_in([chain.leg for chain in self.chains], out) != learned_from(out)
            or any(is_renewal_due(chain.directory) for chain in self.chains if not chain.fault)
        ):
            self._learn()

    def _learn(self) -> None:
        """Set the priors of all legs' forecasts from the measured clearances of the fleet."""
        priors, self.learned = learn_fleet([chain.leg for chain in self.chains], self.chains[0].out)
        for chain in self.chains:
            if chain.leg.id in priors:
                chain.leg = chain.leg.with_priors(priors[chain.leg.id])


def _refuse_shared(chains: Sequence[Chain]) -> None:
    """Refuse recordings that two legs share by content, unless each leg has a topic of its own in them."""
    owners: dict[str, list[Chain]] = {}
    for chain in chains:
        for found in {each.key: each for each in chain.found}.values():
            owners.setdefault(found.key, []).append(chain)
    for key, sharing in owners.items():
        topics = [chain.leg.joint_states for chain in sharing]
        if len(sharing) > 1 and (None in topics or len(set(topics)) < len(topics)):
            for chain in sharing:
                others = ", ".join(other.leg.id for other in sharing if other is not chain)
                chain.refuse(key, f"the leg {others} has a recording with the same content; not counted")


# Which recordings are complete, for an update that is repeated while others are being recorded.


PATIENCE = 6
"""Checks in which a recording without an end must be unchanged: its recorder may have been killed."""

# what a recorder writes last, by the kind of the file
_LAST_BYTES = {".mcap": MAGIC, PARQUET: b"PAR1"}


class Followed:
    """Finds complete recordings in repeated checks of a fleet."""

    def __init__(self) -> None:
        # state at the last check, and number of checks in a row with that state
        self._states: dict[Path, tuple[tuple[int, int], int]] = {}

    def complete(self, fleet: FleetDescription) -> FleetDescription:
        """Check again: the fleet with complete recordings only, which have an end and did not change.

        Parameters
        ----------
        fleet : FleetDescription
            As it is now.
        """
        return attrs.evolve(
            fleet,
            legs=tuple(
                attrs.evolve(leg, recordings=tuple(filter(self._is_complete, leg.recordings)))
                for leg in fleet.legs
            ),
        )

    def _is_complete(self, path: Path) -> bool:
        state = state_of(path)
        before, unchanged = self._states.get(path, (None, 0))
        unchanged = unchanged + 1 if before == state else 0
        self._states[path] = state, unchanged
        return unchanged >= (1 if has_end(path) else PATIENCE)


def has_end(path: Path) -> bool:
    """Whether a recording contains what its recorder writes last."""
    if path.is_dir():
        return (path / METADATA).is_file()
    try:
        (file,) = find_files([path])[0]
        end = _LAST_BYTES.get(file.storage, b"")
        if file.compressed or not end:
            return False
        with path.open("rb") as content:
            content.seek(-min(len(end), path.stat().st_size), 2)
            return content.read() == end
    except (RecordingError, OSError):
        return False


# The tables of an updated fleet, for Python.


TABLES = ("verdicts", "cycles", "recordings", "lives")


class Fleet:
    """Results of a fleet that ``leg-wear-monitor fleet update`` maintains; the tables require pandas.

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
    >>> worst = fleet.lives().groupby("leg").used_fraction.max()  # doctest: +SKIP
    """

    def __init__(self, path: str | Path) -> None:
        self.path = fleet_directory(path)
        self.overview: FleetOverview = load_overview(self.path)
        self._legs = [(leg.id, leg.lot, LegDirectory(self.path, leg.id)) for leg in self.overview.legs]

    def table(self, name: str) -> Any:
        """A table of pyarrow.

        Parameters
        ----------
        name : str
            ``verdicts``, ``cycles``, ``recordings`` or ``lives``.

        Raises
        ------
        LegWearError
            If pyarrow is not installed.
        """
        if name == "cycles":
            return read_tables((leg, file) for leg, _, files in self._legs for file in files.tables())
        return table_of(name, self._legs)

    def cycles(self) -> "pd.DataFrame":
        """Table with a row for each minute, or each gait cycle, of each leg, in the order of time.

        A joint's column has its name after a dot: ``clearance_m.A``.
        """
        return _frame(self.table("cycles"))

    def verdicts(self) -> "pd.DataFrame":
        """Table with a row for each counted recording: the verdict at its end."""
        return _frame(self.table("verdicts"))

    def recordings(self) -> "pd.DataFrame":
        """Table with a row for each recording: whether it was counted, and if not, why."""
        return _frame(self.table("recordings"))

    def lives(self) -> "pd.DataFrame":
        """Table with a row for each counted recording and joint, and for the ``leg``: clearance and life."""
        return _frame(self.table("lives"))

    def export(self, out: str | Path) -> list[Path]:
        """Write all tables as CSV and Parquet files; returns the files.

        Parameters
        ----------
        out : str or pathlib.Path
            Directory; created if it does not exist.
        """
        files = []
        for name in TABLES:
            table = self.table(name)
            for ending in ("csv", "parquet"):
                files.append(Path(out) / f"{name}.{ending}")
                write_table(files[-1], table)
        return files


def _frame(table: Any) -> "pd.DataFrame":
    data_frame({})  # one line if pandas is not installed
    frame: pd.DataFrame = table.to_pandas()
    return frame


# The check of a description before an update: its legs, their parameters, and their recordings.


_DAY_NS = 86_400 * 10**9  # smaller stamps are no dates


def understood(
    fleet: FleetDescription, progress: Callable[[float], None] | None = None
) -> Iterator[tuple[str, str]]:
    """Summary and faults of a description: pairs of a line and a fault, one of which is empty.

    Of each leg the first and the last recording by name are opened, so that a column or a topic that is
    missing shows before an update; damage within a recording does not.

    Parameters
    ----------
    fleet : FleetDescription
    progress : callable, optional
        Called with the completed fraction, 0 to 1.
    """
    number = sum(len(leg.recordings) for leg in fleet.legs)
    legs, recordings = _count_of(len(fleet.legs), "leg"), _count_of(number, "recording")
    yield f"fleet of {legs}, {recordings}, kept in {fleet.out}", ""
    for done, leg in enumerate(fleet.legs, 1):
        outermost = [
            (each, *begin_of(each, leg)) for each in dict.fromkeys(leg.recordings[:1] + leg.recordings[-1:])
        ]
        yield _leg_line(leg, [begin_ns for _, begin_ns, _ in outermost if begin_ns]), ""
        for path, _, fault in outermost:
            if fault:
                yield "", f"{leg.id}: {leg.shown(path)}: {fault}"
        if progress:
            progress(done / len(fleet.legs))


def _leg_line(leg: FleetLeg, begins_ns: list[int]) -> str:
    megabytes = sum(state_of(path)[0] for path in leg.recordings) / 1.0e6
    parts = [f"{_count_of(len(leg.recordings), 'recording')}, {megabytes:.3g} MB"]
    parts.append(f"parameters {leg.config_file.name if leg.config_file else 'of the package'}")
    if leg.config.hardware != leg.id:
        parts.append(f"hardware {leg.config.hardware}")
    if leg.lot:
        parts.append(f"lot {leg.lot}")
    if begins_ns and max(begins_ns) < _DAY_NS:
        parts.append("stamps without a date")
    return f"{leg.id}: {'; '.join(parts)}"


def _count_of(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
