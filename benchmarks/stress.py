"""Ten thousand cycles with five clearance joints and accelerated wear, until clearances have doubled.

Says how well energy adds up, and whether the worn volume is what the contacts took:
`python benchmarks/stress.py`.
"""

import argparse
import time

import attrs
import numpy as np

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceRun
from leg_wear_monitor.dynamics.run import ARCHARD, new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.dynamics.statistics import energy_balance, joint_statistics
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.wear import worn_volume

JOINTS = ("A", "B", "G", "I", "J")


def hastened(leg: Mechanism, cycles: int) -> Mechanism:
    """The leg with wear coefficients that would double the clearance of each joint in so many cycles."""
    setup = prepare(leg, clearances=JOINTS)
    run, statistics = ClearanceRun(setup), new_run_statistics(len(leg.joints))
    run.advance(20.0, statistics)
    figures = joint_statistics(setup, statistics, setup.surfaces.depth, 20.0)
    clearances = dict(leg.clearances)
    for name in JOINTS:
        depth = figures[name].wear_depth_m_per_cycle
        rate = (depth.bushing_max + depth.journal_max) / leg.clearances[name].wear_coefficient[0]
        hasty = leg.clearances[name].radial_clearance / cycles / rate
        clearances[name] = attrs.evolve(leg.clearances[name], wear_coefficient=(hasty, hasty))
    return attrs.evolve(leg, clearances=clearances)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cycles", type=int, default=10_000)
    cycles = parser.parse_args().cycles
    # growing clearances slow the wear of one spot down, so aim at a third of the way
    leg = hastened(load_mechanism("bionic_leg"), cycles // 3)
    setup = prepare(leg, clearances=JOINTS, wear=True)
    run, chunk = ClearanceRun(setup), max(1, cycles // 100)
    total, residuals, began = np.zeros(len(leg.joints)), [], time.process_time()
    heads = "".join(f"{name + ' max mm':>10}" for name in JOINTS)
    print(f"{'cycles':>7}  {heads}   energy residual / losses")
    for done in range(0, cycles, chunk):
        statistics, stored = new_run_statistics(len(leg.joints)), run.stored_energy
        run.advance(float(done + chunk), statistics)
        balance = energy_balance(statistics, stored, run.stored_energy)
        residuals.append(balance.residual / (balance.friction_loss + balance.contact_loss))
        total += statistics.integral[:, ARCHARD]
        if (done // chunk) % 10 == 9:
            largest = setup.contacts.clearance + setup.surfaces.depth.sum(axis=1).max(axis=1)
            sizes = "".join(f"{1e3 * c:10.3f}" for c in largest)
            print(f"{done + chunk:7d}  {sizes}{residuals[-1]:15.2e}")
    spent = time.process_time() - began
    coefficient = setup.contacts.wear_coefficient
    taken = coefficient * (total[setup.contacts.joint] - run.stepper.state.pending[0])[:, None]
    lost = np.abs(worn_volume(setup.contacts, setup.surfaces) / taken - 1.0).max()
    middle, most = np.median(np.abs(residuals)), np.abs(residuals).max()
    print(f"energy residual over losses, {chunk} cycles at a time: median {middle:.1e}, largest {most:.1e}")
    print(f"worn volume against k times the Archard integral: off by at most {lost:.1e}")
    print(f"{cycles} cycles in {spent:.0f} s of one core: {cycles / spent:.0f} times real time")


if __name__ == "__main__":
    main()
