"""What films of oil or grease cost: the leg with five clearance joints, dry and greased, in turns.

    python benchmarks/films.py

One core, one thread; medians over the turns, by the processor's time. About a minute.
"""

import argparse
from statistics import median

import one_core  # noqa: F401  before numpy

# isort: split
import attrs
from watch import Watch

from leg_wear_monitor import Mechanism, load_mechanism
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceRun
from leg_wear_monitor.dynamics.run import new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.spec import Film

FIVE = ("A", "B", "G", "I", "J")
VISCOSITIES = (0.0, 0.01, 0.03, 0.1, 0.3, 1.0)  # Pa s
ROUGHNESS = 1.6e-6  # m


def greased(leg: Mechanism, viscosity: float) -> Mechanism:
    if viscosity == 0.0:
        return leg
    film = Film(viscosity_pa_s=viscosity, roughness_m=ROUGHNESS)
    return attrs.evolve(leg, clearances={n: attrs.evolve(c, film=film) for n, c in leg.clearances.items()})


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=5, help="turns of each leg")
    parser.add_argument("--cycles", type=int, default=10, help="gait cycles of a turn")
    options = parser.parse_args()
    leg = load_mechanism("bionic_leg")
    runs = [ClearanceRun(prepare(greased(leg, each), clearances=FIVE)) for each in VISCOSITIES]
    statistics = [new_run_statistics(len(leg.joints)) for _ in runs]
    for run in runs:
        run.advance(1.0, new_run_statistics(len(leg.joints)))
    times: list[list[float]] = [[] for _ in runs]
    for _ in range(options.repeats):
        for run, tally, spent in zip(runs, statistics, times, strict=True):
            watch = Watch()
            run.advance(run.time + options.cycles, tally)
            spent.append(watch.processor / options.cycles)
    print(f"{'viscosity [Pa s]':>18} {'steps/cycle':>12} {'ms/cycle':>10} {'factor':>8} {'of dry':>8}")
    for viscosity, tally, spent in zip(VISCOSITIES, statistics, times, strict=True):
        steps = tally.steps[0] / (options.repeats * options.cycles)
        cost = median(spent)
        ratio = median(each / dry for each, dry in zip(spent, times[0], strict=True))
        print(f"{viscosity or 'dry':>18} {steps:12.0f} {1e3 * cost:10.2f} {1.0 / cost:8.1f} {ratio:8.2f}")


if __name__ == "__main__":
    main()
