"""How fast the full-coordinate model of the leg is, at which accuracy, and what its structure gives.

    python benchmarks/full_coordinates.py

Prints real-time factors (seconds of motion per second of wall clock, one core, compiled), the mean forces at
tolerances around the default against ten times finer than it, and the cost of one evaluation beside that of
dense algebra. About two minutes on one core.
"""

import argparse
import time
from collections.abc import Callable
from statistics import median

import numba
import numpy as np

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.compiled.kernel import entry
from leg_wear_monitor.dynamics.full_model import FullModel, accelerate, add_contacts, full_scratch
from leg_wear_monitor.dynamics.full_run import TOLERANCE_M, FullRun
from leg_wear_monitor.dynamics.run import FORCE, JOINT_RATES, new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.constraints import applied_forces, closures, rotations

LEG = load_mechanism("bionic_leg")
FIVE = ("A", "B", "G", "I", "J")
EVALUATIONS = 20_000


def real_time_factor(
    clearance_joints: tuple[str, ...], tolerance_m: float, repeats: int
) -> tuple[float, float, float]:
    """Motion of a cycle over the wall clock's and the processor's time, medians; steps tried in it."""
    run = FullRun(prepare(LEG, clearances=clearance_joints), tolerance_m=tolerance_m)
    run.advance(1.0, new_run_statistics(len(LEG.joints)))  # compiles, and leaves the start behind
    statistics = new_run_statistics(len(LEG.joints))
    wall, processor = [], []
    for cycle in range(repeats):
        since = time.perf_counter(), time.process_time()
        run.advance(2.0 + cycle, statistics)
        wall.append(time.perf_counter() - since[0])
        processor.append(time.process_time() - since[1])
    return 1.0 / median(wall), 1.0 / median(processor), statistics.steps[0] / repeats


def mean_forces(tolerance_m: float, cycles: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean contact force of the five clearance joints [N], and its standard error over cycles."""
    setup = prepare(LEG, clearances=FIVE)
    run, forces = FullRun(setup, tolerance_m=tolerance_m), []
    run.advance(1.0, new_run_statistics(len(LEG.joints)))
    for cycle in range(cycles):
        statistics = new_run_statistics(len(LEG.joints))
        run.advance(2.0 + cycle, statistics)
        forces.append(statistics.integral[setup.contacts.joint, FORCE])
    return np.mean(forces, axis=0), np.std(forces, axis=0, ddof=1) / np.sqrt(cycles)


@entry
def structured(count, model, surfaces, approach, polynomial, t, q, v, scratch, a, rate, drive_rate):
    """The package's own evaluation, many times."""
    for _ in range(count):
        accelerate(model, surfaces, approach, polynomial, t, q, v, scratch, a, rate, drive_rate)


@numba.njit(error_model="numpy")
def dense(count, model, surfaces, approach, drive, q, v, scratch, a, rate):
    """The same forces and closures, then [M, phi_q^T; phi_q, 0] solved whole by LAPACK, many times."""
    n, m = 3 * (q.shape[0] - 1), scratch.lam.shape[0]
    alpha = model.baumgarte
    for _ in range(count):
        rotations(q, scratch.cs)
        applied_forces(model.arrays, q, v, scratch.cs, scratch.force)
        add_contacts(model, surfaces, approach, q, v, scratch, rate)
        closures(model.arrays, model.rows, q, v, scratch.cs, drive, scratch.phi, scratch.jac, scratch.gamma)
        matrix, right = np.zeros((n + m, n + m)), np.zeros(n + m)
        for i in range(n):
            matrix[i, i] = model.arrays.mass[1 + i // 3, i % 3]
            right[i] = scratch.force[1 + i // 3, i % 3]
        for r in range(m):
            phi_dot = -drive[1] if r == model.rows.drive_row else 0.0
            for side in range(2):
                body = model.rows.body[r, side]
                for d in range(3):
                    phi_dot += scratch.jac[r, side, d] * v[body, d]
                    if body > 0:
                        i = 3 * (body - 1) + d
                        matrix[n + r, i] = matrix[i, n + r] = scratch.jac[r, side, d]
            right[n + r] = scratch.gamma[r] - 2.0 * alpha * phi_dot - alpha * alpha * scratch.phi[r]
        solution = np.linalg.solve(matrix, right)
        for i in range(n):
            a[1 + i // 3, i % 3] = solution[i]


def evaluation_time(function: Callable[..., None], *arguments: object) -> float:
    """Seconds of one evaluation, the least of several rounds."""
    function(1, *arguments)
    rounds = []
    for _ in range(5):
        since = time.perf_counter()
        function(EVALUATIONS, *arguments)
        rounds.append((time.perf_counter() - since) / EVALUATIONS)
    return min(rounds)


def compare_algebra(clearance_joints: tuple[str, ...]) -> tuple[float, float]:
    """Seconds of one evaluation by structure and by dense algebra, which must agree."""
    setup = prepare(LEG, clearances=clearance_joints)
    run = FullRun(setup)
    run.advance(0.3, new_run_statistics(len(LEG.joints)))
    model: FullModel = run.model
    state, drive = run.state, np.array([setup.speed * run.time, setup.speed, 0.0])
    scratch, rate = full_scratch(model), np.zeros((len(LEG.joints), JOINT_RATES))
    a, b = np.zeros_like(run.q), np.zeros_like(run.q)
    both = (model, setup.surfaces, state.approach)
    by_structure = evaluation_time(
        structured, *both, run.polynomial, run.time, run.q, run.v, scratch, a, rate, np.zeros(3)
    )
    by_lapack = evaluation_time(dense, *both, drive, run.q, run.v, scratch, b, rate)
    np.testing.assert_allclose(b, a, atol=1.0e-9 * np.abs(a).max())
    return by_structure, by_lapack


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=9, help="cycles timed for each factor")
    parser.add_argument("--cycles", type=int, default=40, help="cycles of the mean forces")
    options = parser.parse_args()

    print("Real-time factor of the leg at 60 rpm: by the wall clock (by the processor's time)")
    for what, clearance_joints in (("ideal joints", ()), ("five clearances", FIVE)):
        wall, processor, steps = real_time_factor(clearance_joints, TOLERANCE_M, options.repeats)
        print(f"  {what:16} {wall:7.2f} ({processor:.2f}), {steps:,.0f} steps of six evaluations a cycle")

    print(
        f"\nFive clearances, {options.cycles} cycles: mean contact force, off the finest by (standard error)"
    )
    print(f"  {'local error':12} {'factor':>7} {'steps':>9}  " + "".join(f"{joint:>17}" for joint in FIVE))
    finest = mean_forces(0.1 * TOLERANCE_M, options.cycles)
    for scale in (0.1, 1.0, 10.0, 100.0):
        force, error = finest if scale == 0.1 else mean_forces(scale * TOLERANCE_M, options.cycles)
        off = 100.0 * (force / finest[0] - 1.0)
        chance = 100.0 * np.hypot(error, finest[1]) / finest[0]
        cells = (
            f"{f:7.2f} N         " if scale == 0.1 else f"{o:+7.2f} % ({c:.2f})"
            for f, o, c in zip(force, off, chance, strict=True)
        )
        factor, _, steps = real_time_factor(FIVE, scale * TOLERANCE_M, options.repeats)
        mark = "  <- default" if scale == 1.0 else ""
        print(
            f"  {scale * TOLERANCE_M:<9.0e} m  {factor:7.2f} {steps:9,.0f}  "
            + "".join(f"{c:>17}" for c in cells)
            + mark
        )

    print("\nOne evaluation of the accelerations")
    for what, clearance_joints in (("ideal joints", ()), ("five clearances", FIVE)):
        structure, lapack = compare_algebra(clearance_joints)
        print(
            f"  {what:16} structure {1e6 * structure:6.2f} us, dense {1e6 * lapack:6.2f} us: "
            f"{lapack / structure:.1f} times as long"
        )


if __name__ == "__main__":
    main()
