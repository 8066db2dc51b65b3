"""How often measured plays are right, over seeds; `python test/play/coverage.py [SEEDS]` prints it."""

import math
import sys

import attrs
import numpy as np
from play.rocks import COUNTS_PER_TURN, SIGNALS, rocks, servo

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.play.measurement import measure_play


@attrs.frozen
class Coverage:
    """Of seeds: how many were measured, and how many of these were right.

    Attributes
    ----------
    within : int
        Error below one count, or below the stated standard uncertainty.
    within_count, within_sigma, within_two_sigma : int
    findings : int
        Results with findings.
    """

    measured: int
    refused: int
    within: int
    within_count: int
    within_sigma: int
    within_two_sigma: int
    findings: int

    def __str__(self) -> str:
        parts = {
            "one count or sigma": self.within,
            "one count": self.within_count,
            "sigma": self.within_sigma,
            "2 sigma": self.within_two_sigma,
        }
        words = ", ".join(f"{name} {100.0 * part / self.measured:.1f} %" for name, part in parts.items())
        return (
            f"{self.measured} measured, {self.refused} refused, {self.findings} with findings; within {words}"
        )


def coverage(seeds: range, *, with_load: bool, **given) -> Coverage:
    """Measure the rocks of seeds."""
    numbers = dict.fromkeys([each.name for each in attrs.fields(Coverage)], 0)
    for seed in seeds:
        one = rocks(seed, **given)
        load = one.load if with_load else None
        try:
            found = measure_play(one.time_s, one.angle_rad, load, count_rad=one.count_rad)
        except LegWearError as error:
            numbers["refused"] += 1
            if "-v" in sys.argv:
                print(seed, error)
            continue
        error = abs(found.play_rad - one.play_rad)
        numbers["measured"] += 1
        numbers["within"] += error <= max(one.count_rad, found.sigma_rad)
        numbers["within_count"] += error <= one.count_rad
        numbers["within_sigma"] += error <= found.sigma_rad
        numbers["within_two_sigma"] += error <= 2.0 * found.sigma_rad
        numbers["findings"] += bool(found.findings)
    return Coverage(**numbers)


def servo_errors(seeds: range, signal: str, **given: float) -> list[float]:
    """Errors of the plays of servos [counts]; NaN where refused."""
    errors, count = [], 2.0 * math.pi / COUNTS_PER_TURN
    for seed in seeds:
        log = servo(seed, **given)
        load = sum(log[column] for column in SIGNALS[signal])
        try:
            found = measure_play(log["time"], count * log["pos"], load, count_rad=count)
            errors.append(found.play_rad / count - given["counts"])
        except LegWearError:
            errors.append(math.nan)
    return errors


if __name__ == "__main__":
    number = int(sys.argv[1]) if len(sys.argv) > 1 else 500
    for with_load in (True, False):
        print("load signal:" if with_load else "no load signal:")
        print(f"  all drawn: {coverage(range(number), with_load=with_load)}")
        for key, values in (
            ("bits", (12, 14, 16)),
            ("noise", (0.0, 0.3, 2.0)),
            ("stuck", (0.0, 0.15, 0.3)),
            ("drift", (0.0, 30.0)),
            ("counts", (1.5, 5.0, 50.0)),
            ("pushes", (10, 60)),
        ):
            for value in values:
                print(f"  {key} {value}: {coverage(range(number // 2), with_load=with_load, **{key: value})}")
    print("servos, 24 pulls of 0.5 s, 10 Hz, error in counts: median, largest; within one count; refused")
    for signal in SIGNALS:
        for counts in (2.0, 8.0, 14.8):
            errors = np.abs(servo_errors(range(number), signal, counts=counts))
            known = errors[np.isfinite(errors)]
            print(
                f"  {signal}, play {counts}: {np.median(known):.2f}, {known.max():.2f}; "
                f"{np.count_nonzero(known <= 1.0)} of {number}; {number - len(known)}"
            )
