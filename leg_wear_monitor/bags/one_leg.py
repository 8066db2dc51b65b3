"""Check that several files record one leg: same topics, and equal crank angles at equal times."""

import math
from collections.abc import Iterable
from pathlib import Path

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.bags.findings import Finding, RecordingError, Severity
from leg_wear_monitor.bags.sources import Source
from leg_wear_monitor.bags.topics import listed
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.twin.kinds import CRANK
from leg_wear_monitor.twin.sample import NO_FAULT, Samples

_KEPT = 8192  # samples per file that are kept for comparison with other files
_ENOUGH = 20  # smallest number of common samples for a conclusion
_APART_RAD = 0.1  # exceeds the effect of clock offset and noise in two recordings of one crank
_LONGEST_NS = 100_000_000  # longest gap between two samples for interpolation
_ADVICE = "are these two legs? Give one leg at a time, or select its topic with --joint-states"


def check_topics(
    sources: Iterable[Source], topics: dict[str, str], joint_states: str | None
) -> list[Finding]:
    """Check that each file has the crank's topic, or has no other topic that could be a crank's.

    Parameters
    ----------
    sources : iterable of Source
    topics : dict
        Topic by role.
    joint_states : str, optional
        The topic, if the user named it.

    Raises
    ------
    RecordingError
        If a file has a crank's topic in another namespace and the user named no topic.
    """
    topic, findings = topics["joint_states"], []
    for source in sources:
        recorded = {channel.topic for channel in source.file.channels.values()}
        if topic in recorded:
            continue
        others = [other for other in recorded if other.endswith("/joint_states")]
        if others and joint_states is None:
            text = f"has {listed(others)}, where other files have {listed([topic])}: {_ADVICE}"
            raise RecordingError(str(source.bag_file.path), "joint_states", text)
        text = f"has no topic {topic}: no crank is read from it"
        findings.append(Finding(source.bag_file.path, text, Severity.NOTE))
    return findings


@attrs.frozen(eq=False)
class _Motion:
    """Crank angles in order of their stamps."""

    stamp_ns: NDArray[np.int64]
    angle_rad: Floats

    def apart(self, other: "_Motion") -> Floats:
        """Differences [rad] to the angles of `other`, where this motion can be interpolated."""
        after = np.searchsorted(self.stamp_ns, other.stamp_ns)
        inside = (after > 0) & (after < len(self.stamp_ns))
        after, stamps = after[inside], other.stamp_ns[inside]
        step = self.stamp_ns[after] - self.stamp_ns[after - 1]
        close = (step > 0) & (step <= _LONGEST_NS)
        after, step = after[close], step[close]
        begin = self.angle_rad[after - 1]
        part = (stamps[close] - self.stamp_ns[after - 1]) / step
        expected = begin + part * _wrapped(self.angle_rad[after] - begin)
        return np.abs(_wrapped(other.angle_rad[inside][close] - expected))


class OneLeg:
    """Compares the crank angles of files that overlap in time."""

    def __init__(self) -> None:
        self._files: dict[Path, _Motion] = {}

    def add_samples(self, path: Path, samples: Samples) -> None:
        """Compare samples of a file with those of other files; stamps are those of the headers.

        Raises
        ------
        RecordingError
            If another file has different angles at the same times.
        """
        new = _motion(samples)
        if not len(new.stamp_ns):
            return
        for other, motion in self._files.items():
            if other != path:
                apart = motion.apart(new)
                if len(apart) >= _ENOUGH and np.median(apart) > _APART_RAD:
                    text = f"has other crank angles than {other.name} at the same times: {_ADVICE}"
                    raise RecordingError(str(path), "joint_states", text)
        kept = self._files.get(path, new)
        if kept is not new:
            new = _Motion(
                np.concatenate([kept.stamp_ns, new.stamp_ns]), np.concatenate([kept.angle_rad, new.angle_rad])
            )
        order = np.argsort(new.stamp_ns, kind="stable")[-_KEPT:]
        self._files[path] = _Motion(new.stamp_ns[order], new.angle_rad[order])


def _motion(samples: Samples) -> _Motion:
    chosen = samples[(samples["kind"] == CRANK) & (samples["fault"] == NO_FAULT)]
    return _Motion(chosen["stamp_ns"].astype(np.int64), chosen["crank_angle_rad"].astype(float))


def _wrapped(angle: Floats) -> Floats:
    """Angle wrapped to half a turn around 0 [rad]."""
    return np.asarray((angle + math.pi) % TURN - math.pi)
