"""A recording in shadow of today's diagnosis: the trained likelihood's answers beside today's verdict.

`python shadow.py WEIGHTS RECORDING CONFIG [--known 40] [--last 10]` takes the first gait cycles as the
baseline, prints the answer for the last ten where it changes, and then the verdict of a replay.
"""

import argparse
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
from model import KnownLeg, Network
from signals import LINKAGE, context_of, unified

from leg_wear_monitor import load_config, replay
from leg_wear_monitor.estimate.signature import TorqueSensor, signatures
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.recordings.reader import Recording
from leg_wear_monitor.twin.load import torque_size
from leg_wear_monitor.twin.reference import CrankProfile, cycle_profile, mean_profile

LOST = 1.5  # periods: in a longer time between two samples, some were lost


def signed(
    crank_s: np.ndarray, angle: np.ndarray, torque_s: np.ndarray, torque_nm: np.ndarray
) -> Iterator[tuple[np.ndarray, CrankProfile]]:
    """Signature (160,) and crank profile of each whole gait cycle of some samples, in the order of time."""
    turned = np.unwrap(angle, period=TURN)
    ends = np.arange(np.ceil(turned[0] / TURN), np.floor(turned[-1] / TURN) + 1.0) * TURN
    passed = np.interp(ends, turned, crank_s)
    step = np.diff(torque_nm, prepend=np.nan)
    period_s = float(np.median(np.diff(torque_s)))
    step[np.diff(torque_s, prepend=torque_s[0]) > LOST * period_s] = np.nan
    place = np.interp(torque_s, crank_s, turned)
    for begin_s, end_s in pairwise(passed):
        inside = (crank_s >= begin_s) & (crank_s < end_s)
        within = (torque_s >= begin_s) & (torque_s < end_s)
        profile = cycle_profile(crank_s[inside] - begin_s, turned[inside], end_s - begin_s)
        size_nm = torque_size(LINKAGE, profile.speed)
        sensor = TorqueSensor(period_s, end_s - begin_s, size_nm)
        first = np.zeros(int(within.sum()), np.int64)
        row = signatures(first, place[within], torque_nm[within], step[within], sensor)
        yield unified(row, size_nm)[0], profile


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("weights", type=Path)
    parser.add_argument("recording", type=Path)
    parser.add_argument("config", type=Path)
    parser.add_argument("--known", type=int, default=40)
    parser.add_argument("--last", type=int, default=10)
    options = parser.parse_args()
    began = time.process_time()
    with Recording([options.recording], load_config(options.config)) as recording:
        samples = np.concatenate([block.samples for block in recording.blocks()])
    crank, torque = (samples[np.isfinite(samples[name])] for name in ("crank_angle_rad", "torque_nm"))
    series = (1e-9 * (one["stamp_ns"] - samples["stamp_ns"][0]) for one in (crank, torque))
    crank_s, torque_s = series
    cycles = list(signed(crank_s, crank["crank_angle_rad"], torque_s, torque["torque_nm"]))[1:]
    known, profiles = np.array([row for row, _ in cycles[: options.known]]), [one for _, one in cycles]
    context = context_of(mean_profile(profiles[: options.known]))
    leg = KnownLeg(Network(options.weights), known.mean(axis=0), len(known), context)
    print(f"distance {leg.distance:.2f}, ground {leg.peak_n:.0f} N")
    before = ""
    for i in range(options.known + 1, len(cycles) + 1):
        last = np.array([row for row, _ in cycles[max(options.known, i - options.last) : i]])
        answer = leg.posterior(last.mean(axis=0), len(last))
        if answer.found != before:
            before, size = answer.found, 0.3 * np.exp(answer.log_opening)
            print(f"cycle {i}: {before}, {size:.2f} ± {size * answer.sigma:.2f} mm, χ² {answer.square:.2f}")
    print(f"{time.process_time() - began:.1f} s of processor")
    began = time.process_time()
    verdict = replay(options.recording, options.config).summary().verdict
    print(f"today: {verdict.state.value} {verdict.joints}, {time.process_time() - began:.1f} s of processor")


if __name__ == "__main__":
    main()
