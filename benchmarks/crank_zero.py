"""Robots whose encoder starts at zero at each boot: how exactly, and in how many turns, the zero is found.

The legs are those of `commission.py`, with 0.2 to 0.4 mm in each of five joints and one or two cadences.
Each boot begins somewhere in a walk, with a sensor that averages or one that samples instants.
"""

import argparse
import math
from pathlib import Path

import numpy as np
from commission import START_NS, TURN, WALK_S, walk_of, walked

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.estimate.torque_model import TorqueModel, torque_model
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.monitor.crank_walk import Zero
from leg_wear_monitor.monitor.crank_zero import CrankZero
from leg_wear_monitor.monitor.evaluation import A_CYCLE, EvaluationPeriods
from leg_wear_monitor.twin import CRANK, TORQUE
from leg_wear_monitor.twin.sample import Samples, TrackerSettings, gait_samples

BOOTS = 4  # of each cadence and sampling
NOISE_RAD, NOISE_NM = 1.0e-3, 0.3
LONGEST_TURNS = 20


def boot(walk: Floats, begin: int, end: int, sampling: str, seed: list[int]) -> tuple[Samples, float]:
    """Samples from a place of a walk on, whose encoder begins there with 0, and the true zero."""
    rng = np.random.default_rng(seed)
    times, angle, impulse, instant = walk.T
    torque = instant if sampling == "instant" else np.diff(impulse, prepend=0.0) / np.diff(times, prepend=0.0)
    part, n = slice(begin, end), end - begin
    stamps = START_NS + np.round(1.0e9 * times[part]).astype(np.int64)
    read = angle[part] - angle[begin] + NOISE_RAD * rng.standard_normal(n)
    crank = gait_samples(stamps, CRANK, crank_angle_rad=read)
    drive = gait_samples(stamps, TORQUE, torque_nm=torque[part] + NOISE_NM * rng.standard_normal(n))
    both = np.concatenate([crank, drive])
    return both[np.argsort(both["stamp_ns"], kind="stable")], float(angle[begin])


def found(search: CrankZero, samples: Samples, rpm: float) -> Zero | None:
    """The zero that a search finds among samples."""
    for piece, ends in EvaluationPeriods(round(60.0e9 / abs(rpm)) // A_CYCLE).pieces(samples):
        search.passed(piece, ends)
    return search.state.zero


def row(seed: int, number: int, sampling: str, walk: Floats, model: TorqueModel) -> str:
    """A row of the table: the boots of one robot at one of its cadences."""
    how, zeros, errors = walk_of(seed), [], []
    rpm, length_s = float(f"{how['speeds_rpm'][number]:.3g}"), WALK_S / len(how["speeds_rpm"])
    longest_s = LONGEST_TURNS * 60.0 / abs(rpm)
    config = config_from(
        {
            "crank.zero": "at_start",
            "cadence.commanded_rpm": rpm,
            "cadence.tolerance_rpm": 0.1 * abs(rpm),
            "drive_torque.sampling": sampling,
        }
    )
    for k in range(BOOTS):
        last_s = max(1.0, length_s - longest_s)
        begin_s = number * length_s + float(np.random.default_rng([seed, number, k]).uniform(1.0, last_s))
        end_s = min(begin_s + longest_s, (number + 1) * length_s - 0.5)
        begin, end = (int(each * how["rate_hz"]) for each in (begin_s, end_s))
        samples, truth = boot(walk, begin, end, sampling, [seed, number, k, 1])
        search = CrankZero(model, config, TrackerSettings(commanded_speed_radps=rpm * TURN / 60.0))
        zero = found(search, samples, rpm)
        if zero is not None:
            zeros.append(zero)
            errors.append(math.remainder(zero.offset_rad - truth, TURN))
    cells = (
        f"{seed}",
        f"{rpm:g}",
        f"{how['rate_hz']}",
        f"{how['toe_force_n']:g}",
        sampling,
        f"{len(zeros)} of {BOOTS}",
        ", ".join(str(zero.turns) for zero in zeros),
        ", ".join(f"{error:+.3f}" for error in errors),
        ", ".join(f"{zero.sigma_rad:.3f}" for zero in zeros),
    )
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=201, help="first seed")
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--cache", type=Path, help="directory in which walks are kept")
    given = parser.parse_args()
    model = torque_model(load_mechanism("bionic_leg"))
    print("| seed | rpm | Hz | foot load, N | sampling | found | turns | errors, rad | stated, rad |")
    print("|---|---|---|---|---|---|---|---|---|")
    for seed in range(given.first, given.first + given.robots):
        walk = walked(seed, given.cache)
        for number in range(len(walk_of(seed)["speeds_rpm"])):
            for sampling in ("average", "instant"):
                print(row(seed, number, sampling, walk, model), flush=True)


if __name__ == "__main__":
    main()
