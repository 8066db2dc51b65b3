"""Print the tables of validation.md on the leg with clearances: sections 7 to 9. About three minutes."""

import argparse

import numpy as np

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.full_run import BAUMGARTE, TOLERANCE_M, FullRun
from leg_wear_monitor.dynamics.run import ARCHARD, CONTACT, FORCE, new_run_statistics, percentile
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.dynamics.statistics import energy_balance
from leg_wear_monitor.mechanism.constraints import closures_at
from leg_wear_monitor.mechanism.position import TURN, build_linkage, dense_jacobian, one_cycle

LEG = load_mechanism("bionic_leg")
APART = 1.0e-9  # m: what the clearances of two runs differ by, enough to make them two samples of the chaos
SETS = ("G", "AB", "IJ", "ABGIJ")


def row(*cells: str) -> None:
    print(f"| {' | '.join(cells)} |")


def table(*columns: str) -> None:
    """Head of a Markdown table."""
    row(*columns)
    row(*("---" for _ in columns))


def cycles(clearance_joints: str, count: int, clearance_m: float = 3.0e-4, tolerance_m: float = TOLERANCE_M):
    """Mean force, Archard integral, contact, p99 of each cycle after the first second and clearance joint.

    With them the energy balances, and each bushing's deepest wear per cycle.
    """
    setup = prepare(LEG, clearances=tuple(clearance_joints), clearance_m=clearance_m)
    run, joints = FullRun(setup, tolerance_m=tolerance_m), setup.contacts.joint
    run.advance(1.0, new_run_statistics(len(LEG.joints)))
    before, figures, energies = setup.surfaces.depth.copy(), [], []
    for second in range(count):
        statistics, stored = new_run_statistics(len(LEG.joints)), run.stored_energy
        run.advance(2.0 + second, statistics)
        p99 = [percentile(statistics.force_time[j], 0.99) for j in joints]
        figures.append(np.column_stack([statistics.integral[joints][:, [FORCE, ARCHARD, CONTACT]], p99]))
        energies.append(energy_balance(statistics, stored, run.stored_energy))
    return np.array(figures), energies, (setup.surfaces.depth - before)[:, 0].max(axis=1) / count


def clearance_sets(runs: int, count: int) -> None:
    print(f"\n### Clearance sets: {runs} runs of {count} cycles\n")
    print(
        "Mean over all; in brackets the standard deviation of single cycles, then that of the runs' means.\n"
    )
    table("clearance joints", "joint", "mean force [N]", "99 % below [N]", "in contact",
          "Archard integral [J/cycle]", "deepest wear of the bushing [1e-12 m/cycle]")  # fmt: skip
    balances = {}
    for clearance_joints in SETS:
        results = [cycles(clearance_joints, count, 3.0e-4 + i * APART) for i in range(runs)]
        figures = np.array([result[0] for result in results])
        depth = 1.0e12 * np.array([result[2] for result in results])
        balances[clearance_joints] = [energy for result in results for energy in result[1]]
        for k, joint in enumerate(clearance_joints):
            cells = [_spread(figures[:, :, k, i], digits) for i, digits in ((0, 2), (3, 0), (2, 3), (1, 3))]
            deep = f"{depth[:, k].mean():.2f} ({depth[:, k].std(ddof=1):.2f})"
            row(", ".join(clearance_joints), joint, *cells, deep)
    print("\n### Energy balance of each cycle\n")
    table(
        "clearance joints",
        "friction [J/cycle]",
        "contact [J/cycle]",
        "residual, largest [J]",
        "largest over the cycle's losses",
    )
    for clearance_joints, energies in balances.items():
        keys = ("friction_loss", "contact_loss", "residual")
        friction, contact, residual = (
            np.array([getattr(energy, key) for energy in energies]) for key in keys
        )
        largest, fraction = np.abs(residual).max(), (np.abs(residual) / (friction + contact)).max()
        cells = f"{friction.mean():.4f}", f"{contact.mean():.4f}", f"{largest:.1e}", f"{fraction:.1e}"
        row(", ".join(clearance_joints), *cells)


def _spread(samples: np.ndarray, digits: int) -> str:
    """Mean of samples (runs, cycles), their scatter by cycles and by runs."""
    by_cycle, by_run = samples.std(axis=1, ddof=1).mean(), samples.mean(axis=1).std(ddof=1)
    return f"{samples.mean():.{digits}f} ({by_cycle:.{digits}f}; {by_run:.{digits}f})"


def chaos() -> None:
    """When two runs whose clearances differ by APART have nothing to do with each other any more."""
    print("\n### Chaos\n")
    table("clearance joints", "time until some body deviates by a tenth of the clearance [ms]")
    for clearance_joints in SETS:
        pair = [
            FullRun(prepare(LEG, clearances=tuple(clearance_joints), clearance_m=3.0e-4 + i * APART))
            for i in range(2)
        ]
        statistics, t, apart = new_run_statistics(len(LEG.joints)), 0.0, 0.0
        while apart < 3.0e-5:
            t += 1.0e-3
            for run in pair:
                run.advance(t, statistics)
            apart = np.abs(pair[0].q[:, :2] - pair[1].q[:, :2]).max()
        row(", ".join(clearance_joints), f"{1e3 * t:.0f}")


def tolerance(count: int) -> None:
    print(f"\n### Tolerance: {count} cycles, five clearance joints\n")
    table("local error [m, rad]", *(f"mean force {joint} [N]" for joint in "ABGIJ"), "residual over losses")
    for tolerance_m in sorted({1.0e-8, 1.0e-9, TOLERANCE_M, 1.0e-10, 1.0e-11}, reverse=True):
        figures, energies, _ = cycles("ABGIJ", count, tolerance_m=tolerance_m)
        fraction = max(abs(e["residual"]) / (e["friction_loss"] + e["contact_loss"]) for e in energies)
        row(
            f"{tolerance_m:.0e}",
            *(f"{force:.2f}" for force in figures[:, :, 0].mean(axis=0)),
            f"{fraction:.1e}",
        )


def vanishing_clearance(count: int) -> None:
    linkage = build_linkage(LEG)
    force = np.linalg.norm(one_cycle(linkage, 1440, TURN).joint_force, axis=2).mean(axis=0)
    print(f"\n### Clearance towards 0: {count} cycles, five clearance joints\n")
    table("clearance [mm]", *(f"mean force {joint} [N]" for joint in "ABGIJ"))
    for clearance_m in (1.0e-3, 3.0e-4, 1.0e-4, 3.0e-5, 1.0e-5):
        means = cycles("ABGIJ", count, clearance_m)[0][:, :, 0].mean(axis=0)
        row(f"{1e3 * clearance_m:g}", *(f"{mean:.2f}" for mean in means))
    row("ideal", *(f"{force[list(LEG.joints).index(joint)]:.2f}" for joint in "ABGIJ"))


def drift(seconds: int) -> None:
    print(f"\n### Drift of the closures over {seconds} s\n")
    table("clearance joints", "Baumgarte [1/s]", "position [m, rad]", "velocity [m/s, rad/s]")
    for clearance_joints, baumgarte in (("", BAUMGARTE), ("ABGIJ", BAUMGARTE), ("ABGIJ", 0.0)):
        run, statistics = (
            FullRun(prepare(LEG, clearances=tuple(clearance_joints))),
            new_run_statistics(len(LEG.joints)),
        )
        run.model = run.model._replace(baumgarte=baumgarte)
        rows, worst = run.model.rows, np.zeros(2)
        phi, blocks, gamma = (
            np.empty(len(rows.body)),
            np.zeros((len(rows.body), 2, 3)),
            np.empty(len(rows.body)),
        )
        for i in range(100 * seconds):
            run.advance((i + 1) / 100.0, statistics)
            cs = np.empty((len(run.q), 2))
            at = np.array([TURN * run.time, TURN, 0.0])
            closures_at(run.model.arrays, rows, run.q, run.v, at, cs, phi, blocks, gamma)
            phi_dot = dense_jacobian(rows, blocks, len(run.q)) @ run.v[1:].ravel()
            phi_dot[rows.drive_row] -= TURN
            worst = np.maximum(worst, [np.abs(phi).max(), np.abs(phi_dot).max()])
        row(", ".join(clearance_joints) or "none", f"{baumgarte:g}", f"{worst[0]:.1e}", f"{worst[1]:.1e}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=8, help="runs of each set")
    parser.add_argument("--cycles", type=int, default=20, help="cycles of each run")
    options = parser.parse_args()
    clearance_sets(options.runs, options.cycles)
    chaos()
    tolerance(10)
    vanishing_clearance(5)
    drift(10)
