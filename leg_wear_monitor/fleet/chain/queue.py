"""The recordings of a leg that are to be counted, and the state of the work on them."""

from collections.abc import Iterable
from pathlib import Path

import attrs

from leg_wear_monitor.fleet.chain.count import count_or_fault
from leg_wear_monitor.fleet.chain.record import Outcome
from leg_wear_monitor.fleet.chain.scan import Found, entry_of, known, scan
from leg_wear_monitor.fleet.description.fleet_description import FleetLeg
from leg_wear_monitor.fleet.directory.leg_directory import LegDirectory, Line
from leg_wear_monitor.workers.code import package_digest
from leg_wear_monitor.workers.job import Job


@attrs.define(eq=False)
class Chain:
    """A leg in an update.

    Attributes
    ----------
    leg : FleetLeg
    out : pathlib.Path
        Directory of the fleet.
    waiting : list of Found
        Recordings that are to be counted, the next one last.
    found : list of Found
        All of its recordings, in the order of time.
    new : list of dict
        Records of this update.
    copies : list of str
        Lines about copies that were not known before.
    refused : list of str
        Recordings that are not counted because another leg has them.
    is_renewed : bool
        Whether its forecast was made again, because something was measured.
    fault : str
        Why the leg could not go on; empty if it could.
    """

    leg: FleetLeg
    out: Path
    waiting: list[Found] = attrs.Factory(list)
    found: list[Found] = attrs.Factory(list)
    new: list[Line] = attrs.Factory(list)
    copies: list[str] = attrs.Factory(list)
    refused: list[str] = attrs.Factory(list)
    is_renewed: bool = False
    fault: str = ""
    _settled: set[str] = attrs.Factory(set)
    _pending: str = ""
    _last_ns: int = 0

    @property
    def directory(self) -> LegDirectory:
        """Files of the leg."""
        return LegDirectory(self.out, self.leg.id)

    @property
    def waiting_bytes(self) -> int:
        """Bytes of the recordings that are to be counted."""
        return sum(each.size for each in self.waiting)

    def begin(self) -> Job | None:
        """Read what is known of the leg; the job that reads unknown recordings, None if there are none."""
        lines = list(self.directory.lines())
        self.directory.remove_parts()
        if any(line["outcome"] == "counted" for line in lines) and not self.directory.ledger.exists():
            self.fault = f"{self.directory.ledger} is missing: put a copy of it back"
            return None
        for line in lines:
            if Outcome(line["outcome"]).is_final or line["settings"] == self.leg.settings:
                self._settled.add(line["key"])
            self._last_ns = max(self._last_ns, line["end_ns"])
        pending = self.directory.pending()
        if pending and pending["key"] in self._settled:
            self.directory.forget_pending()
        elif pending:
            self._pending = pending["key"]
        files = self.directory.files()
        found = [known(path, files) for path in self.leg.recordings]
        self.found = [each for each in found if each is not None]
        if len(self.found) == len(found):
            return None
        return Job(f"scan-{self.leg.id}", scan, (self.leg, files), float(len(found) - len(self.found)))

    def take(self, found: Iterable[Found]) -> None:
        """Take the recordings that were read; what of them can be read is known from now on."""
        before = {each.path for each in self.found}
        self.found = list(found)
        first: dict[str, Found] = {}
        for each in sorted(self.found, key=lambda one: (one.path not in before, str(one.path))):
            if first.setdefault(each.key, each) is not each and each.path not in before:
                original = self.leg.shown(first[each.key].path)
                self.copies.append(f"{self.leg.shown(each.path)}: is a copy of {original}, counted once")
        self.directory.note(self.copies)  # before they are known: a kill in between must not lose a line
        self.directory.keep_files({str(each.path): entry_of(each) for each in self.found if each.size})

    def plan(self) -> None:
        """Queue what is not counted yet: what is pending, then in the order of time, each content once."""
        self.found.sort(key=lambda each: (each.key != self._pending, each.begin_ns, each.key, str(each.path)))
        queue: dict[str, Found] = {}
        for each in self.found:
            if each.key not in self._settled and not self.fault:
                queue.setdefault(each.key, each)
        self.waiting = list(reversed(queue.values()))

    def refuse(self, key: str, why: str) -> None:
        """Do not count a recording in this update."""
        self.refused += [f"{self.leg.shown(each.path)}: {why}" for each in self.waiting if each.key == key]
        self.waiting = [each for each in self.waiting if each.key != key]

    def next_job(self) -> Job | None:
        """The job that counts the next recording; None if the leg is up to date or cannot go on."""
        if not self.waiting or self.fault:
            return None
        found = self.waiting[-1]
        leg = attrs.evolve(self.leg, recordings=())
        arguments = (leg, self.out, found, self._last_ns, package_digest())
        return Job(f"count-{leg.id}-{found.key}", count_or_fault, arguments, float(self.waiting_bytes))

    def done(self, result: Line | str) -> None:
        """Take the result of `next_job`."""
        if isinstance(result, str):
            self.fault = result
            return
        self.waiting.pop()
        self.new.append(result)
        self._last_ns = max(self._last_ns, result["end_ns"])
