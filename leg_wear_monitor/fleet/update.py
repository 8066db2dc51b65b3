"""Brings the ledgers of a fleet up to date with recordings that are not counted yet."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs

from leg_wear_monitor.bags.bag import METADATA, PARQUET, find_files
from leg_wear_monitor.bags.findings import RecordingError
from leg_wear_monitor.bags.mcap_layout import MAGIC
from leg_wear_monitor.files import data_frame
from leg_wear_monitor.fleet.chain import Chain, begin_of, state_of, words_of
from leg_wear_monitor.fleet.description import FleetDescription, FleetLeg, fleet_directory
from leg_wear_monitor.fleet.directory import (
    LegDirectory,
    arrow,
    lives_table,
    locked,
    make_directory,
    read_tables,
    recordings_table,
    verdicts_table,
    write_table,
)
from leg_wear_monitor.fleet.overview import FleetOverview, load_overview, write_overview
from leg_wear_monitor.fleet.renew import is_renewal_due, learn_fleet, learned_from, measured_in, renew
from leg_wear_monitor.workers import Job, run_here, run_in_processes, run_on_cluster

if TYPE_CHECKING:
    import pandas as pd


_NOT_COUNTED = ("no_gait", "already_counted")

Tell = Callable[[str, str], None]
"""Called with the id of a leg and a line about it."""


@attrs.frozen
class FleetUpdate:
    """What an update did.

    Attributes
    ----------
    chains : tuple of Chain
        The legs, in the order of the description.
    learned : tuple of (str, str)
        The leg, and a line about what is not learned from its measured clearances.
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
        """Number of legs without a new recording whose forecast follows a measurement."""
        return sum(chain.is_renewed and not chain.fault for chain in self.chains)

    @property
    def findings(self) -> list[tuple[str, str]]:
        """What a person must see: the leg, and a line about what is lost or was not done."""
        found = list(self.learned)
        for chain in self.chains:
            bad = [line for line in chain.new if line["is_partial"] or line["outcome"] in _NOT_COUNTED]
            found += [(chain.leg.id, words_of(line)) for line in bad]
            found += [(chain.leg.id, text) for text in [*chain.refused, chain.fault] if text]
        return found


def update_fleet(
    fleet: FleetDescription,
    out: Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    sample: float | None = None,
    begin: Callable[[Sequence[Chain]], None] | None = None,
    progress: Callable[[float], None] | None = None,
    tell: Tell | None = None,
) -> FleetUpdate:
    """Count what is not counted yet: each leg in the order of time, the legs independently of each other.

    Interrupted, it keeps every recording that is finished; the next update goes on there.

    Parameters
    ----------
    fleet : FleetDescription
    out : pathlib.Path
        Directory of the fleet.
    workers : int
        Number of local processes; 1 uses this process only. Results do not depend on it.
    scheduler : str, optional
        Address of a Dask scheduler whose workers count instead; they need the same files at the same paths.
    sample : float, optional
        Fraction of the gait cycles that are followed, as in `leg_wear_monitor.replay`; without it, all.
    begin : callable, optional
        Called with the legs that have work, before it begins, such as to compile.
    progress : callable, optional
        Called with the completed fraction of the work, 0 to 1.
    tell : callable, optional
        Called with the id of a leg and a line, for each recording.

    Raises
    ------
    ConfigError
        If another process updates this directory, or it cannot be written to.
    LegWearError
        If pyarrow is not installed, or workers die repeatedly.
    """
    arrow()
    out = out.absolute()
    with locked(out):
        work = _Work([Chain(attrs.evolve(leg, sample=sample), out) for leg in fleet.legs], progress, tell)
        scans = work.scans()
        if begin and (scans or work.is_due):
            begin(work.chains)
        if jobs := scans or work.first_jobs():
            _run(jobs, work.done, workers, scheduler)
        write_overview(fleet, out, {chain.leg.id: _first_fault(chain) for chain in work.chains})
    return FleetUpdate(tuple(work.chains), work.learned)


def _first_fault(chain: Chain) -> str:
    return next(filter(None, [chain.fault, *chain.refused]), "")


def _run(jobs: Sequence[Job], done: Any, workers: int, scheduler: str | None) -> None:
    if scheduler is not None:
        run_on_cluster(jobs, scheduler, done)
    elif workers > 1:
        run_in_processes(jobs, workers, done)
    else:
        run_here(jobs, done)


class _Work:
    """All legs: first unknown recordings are read, then all that is not counted yet is counted."""

    def __init__(
        self, chains: list[Chain], progress: Callable[[float], None] | None, tell: Tell | None
    ) -> None:
        self.chains = chains
        self._by_leg = {chain.leg.id: chain for chain in chains}
        self._progress, self._tell = progress or (lambda _fraction: None), tell or (lambda *_: None)
        self._scans = 0
        self._total = 1
        self.learned: tuple[tuple[str, str], ...] = ()

    @property
    def is_due(self) -> bool:
        """Whether anything that is known is not counted yet; after `scans`."""
        return any(chain.waiting for chain in self.chains)

    def scans(self) -> list[Job]:
        """Jobs that read the recordings that are not known yet."""
        jobs = [job for job in (chain.begin() for chain in self.chains) if job is not None]
        self._scans = len(jobs)
        if not jobs:
            self._plan()
        return jobs

    def first_jobs(self) -> list[Job]:
        """The first recording of each leg, or its forecast."""
        return [job for job in map(self._next_job, self.chains) if job is not None]

    def _next_job(self, chain: Chain) -> Job | None:
        """The next recording of a leg; after the last one, its forecast if something was measured."""
        if chain.waiting or chain.fault or chain.is_renewed or not is_renewal_due(chain.directory):
            return chain.next_job()
        leg = attrs.evolve(chain.leg, recordings=())
        return Job(f"renew-{leg.id}", renew, (leg, chain.directory))

    def done(self, job: Job, result: Any) -> list[Job]:
        """Take a result; the jobs that follow from it."""
        chain = self._by_leg[job.arguments[0].id]
        if job.key.startswith("scan-"):
            chain.take(result)
            self._scans -= 1
            if self._scans:
                return []
            self._plan()
            return self.first_jobs()
        if job.key.startswith("renew-"):
            chain.is_renewed, chain.fault = True, result
            return []
        chain.done(result)
        self._tell(chain.leg.id, result if isinstance(result, str) else words_of(result))
        left = sum(each.waiting_bytes for each in self.chains if not each.fault)
        self._progress(1.0 - left / self._total)
        following = self._next_job(chain)
        return [following] if following else []

    def _plan(self) -> None:
        """Queue the recordings of all legs."""
        for chain in self.chains:
            chain.plan()
        _refuse_shared(self.chains)
        for chain in self.chains:
            for line in chain.copies:
                self._tell(chain.leg.id, line)
        self._total = max(1, sum(chain.waiting_bytes for chain in self.chains))
        out = self.chains[0].out
        if (
            self.is_due
            or measured_in([chain.leg for chain in self.chains], out) != learned_from(out)
            or any(is_renewal_due(chain.directory) for chain in self.chains if not chain.fault)
        ):
            self._learn()

    def _learn(self) -> None:
        """Let the forecasts of all legs use what the measured clearances of the fleet tell."""
        learning = learn_fleet([chain.leg for chain in self.chains], self.chains[0].out)
        self.learned = learning.findings
        for chain in self.chains if learning.pairs else ():
            if chain.leg.id in learning.priors:
                chain.leg = chain.leg.with_priors(learning.priors[chain.leg.id])


def _refuse_shared(chains: Sequence[Chain]) -> None:
    """Refuse recordings whose content two legs have, unless the legs have a topic each in it."""
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


# Which recordings are complete, while others are being recorded.


PATIENCE = 6
"""Looks during which a recording without an end must not change: its recorder may have been killed."""

_ENDS = {".mcap": MAGIC, PARQUET: b"PAR1"}


class Followed:
    """Looks again and again at the recordings of a fleet."""

    def __init__(self) -> None:
        self._seen: dict[Path, tuple[tuple[int, int], int]] = {}

    def complete(self, fleet: FleetDescription) -> FleetDescription:
        """The fleet with the recordings that are complete: unchanged since the last look, and with their end.

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
        before, looks = self._seen.get(path, (None, 0))
        looks = looks + 1 if before == state else 0
        self._seen[path] = state, looks
        return looks >= (1 if has_end(path) else PATIENCE)


def has_end(path: Path) -> bool:
    """Whether a recording has what its recorder writes last."""
    if path.is_dir():
        return (path / METADATA).is_file()
    try:
        (file,) = find_files([path])[0]
        end = _ENDS.get(file.storage, b"")
        if file.compressed or not end:
            return False
        with path.open("rb") as content:
            content.seek(-min(len(end), path.stat().st_size), 2)
            return content.read() == end
    except (RecordingError, OSError):
        return False


# A fleet that was updated, for Python.


TABLES = ("verdicts", "cycles", "recordings", "lives")


class Fleet:
    """A fleet that ``leg-wear-monitor fleet update`` keeps; the tables require pandas.

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
        If no fleet is there.

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
        makers = {"verdicts": verdicts_table, "recordings": recordings_table, "lives": lives_table}
        return makers[name](self._legs)

    def cycles(self) -> "pd.DataFrame":
        """Table with a row for each minute, or each gait cycle, of each leg, in the order of time.

        A joint's column has its name after a dot: ``clearance_m.A``.
        """
        return _frame(self.table("cycles"))

    def verdicts(self) -> "pd.DataFrame":
        """Table with a row for each counted recording: the verdict at its end."""
        return _frame(self.table("verdicts"))

    def recordings(self) -> "pd.DataFrame":
        """Table with a row for each recording: what became of it."""
        return _frame(self.table("recordings"))

    def lives(self) -> "pd.DataFrame":
        """Table with a row for each counted recording and joint, and for the ``leg``: clearance and life."""
        return _frame(self.table("lives"))

    def export(self, out: str | Path) -> list[Path]:
        """Write all tables as CSV and Parquet files; the files.

        Parameters
        ----------
        out : str or pathlib.Path
            Directory, made if it does not exist.
        """
        make_directory(Path(out))
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


# What is understood of the description of a fleet: its legs, their parameters, and their recordings.


_DAY_NS = 86_400 * 10**9


def understood(
    fleet: FleetDescription, progress: Callable[[float], None] | None = None
) -> Iterator[tuple[str, str]]:
    """What is understood, and what is wrong: pairs of a line and a fault, one of which is empty.

    Of each leg the first and the last recording by name are opened, so that a column or a topic that is
    missing shows before an update; damage within a recording does not.

    Parameters
    ----------
    fleet : FleetDescription
    progress : callable, optional
        Called with the completed fraction, 0 to 1.
    """
    number = sum(len(leg.recordings) for leg in fleet.legs)
    yield f"fleet of {_many(len(fleet.legs), 'leg')}, {_many(number, 'recording')}, kept in {fleet.out}", ""
    for done, leg in enumerate(fleet.legs, 1):
        ends = [
            (each, *begin_of(each, leg)) for each in dict.fromkeys(leg.recordings[:1] + leg.recordings[-1:])
        ]
        yield _line(leg, [begin_ns for _, begin_ns, _ in ends if begin_ns]), ""
        for path, _, fault in ends:
            if fault:
                yield "", f"{leg.id}: {leg.shown(path)}: {fault}"
        if progress:
            progress(done / len(fleet.legs))


def _line(leg: FleetLeg, begins_ns: list[int]) -> str:
    megabytes = sum(state_of(path)[0] for path in leg.recordings) / 1.0e6
    parts = [f"{_many(len(leg.recordings), 'recording')}, {megabytes:.3g} MB"]
    parts.append(f"parameters {leg.config_file.name if leg.config_file else 'of the package'}")
    if leg.config.hardware != leg.id:
        parts.append(f"hardware {leg.config.hardware}")
    if leg.lot:
        parts.append(f"lot {leg.lot}")
    if begins_ns and max(begins_ns) < _DAY_NS:
        parts.append("stamps without a date")
    return f"{leg.id}: {'; '.join(parts)}"


def _many(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
