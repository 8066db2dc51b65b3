"""Brings the ledgers of a fleet up to date with recordings that are not counted yet."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import attrs

from leg_wear_monitor.fleet.chain.queue import Chain
from leg_wear_monitor.fleet.chain.words import words_of
from leg_wear_monitor.fleet.description.fleet_description import FleetDescription
from leg_wear_monitor.fleet.directory.lock import locked
from leg_wear_monitor.fleet.learning.files import learned_from
from leg_wear_monitor.fleet.learning.of_fleet import learn_fleet, measured_in
from leg_wear_monitor.fleet.learning.renew import is_renewal_due, renew
from leg_wear_monitor.fleet.overview.make import write_overview
from leg_wear_monitor.fleet.tables.parquet import arrow
from leg_wear_monitor.workers.cluster import run_on_cluster
from leg_wear_monitor.workers.job import Job
from leg_wear_monitor.workers.processes import run_here, run_in_processes

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
