"""Print the tables of validation.md that compare with published results: sections 1 to 6.

Cases and wanted values are those of the tests, taken from their files.
"""

import json
import math
import runpy
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.contact.arrays import compile_contacts
from leg_wear_monitor.contact.laws import HERTZ, LAWS, delivered_restitution
from leg_wear_monitor.dynamics.full_run import TOLERANCE_M, FullRun
from leg_wear_monitor.dynamics.run import POWER, new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle, point_motion

TEST = Path(__file__).parents[2] / "test"


def case(name: str) -> dict[str, Any]:
    """What a test file defines."""
    return runpy.run_path(str(TEST / name))


def table(*columns: str) -> None:
    """Head of a Markdown table."""
    row(*columns)
    row(*("---" for _ in columns))


def row(*cells: str) -> None:
    print(f"| {' | '.join(cells)} |")


def andrews() -> None:
    wanted = case("dynamics/test_full.py")
    print("\n### Andrews' squeezing mechanism\n")
    table(
        "local error [m, rad]",
        "angles, largest error [rad]",
        "forces at P, largest error",
        "work less energy",
    )
    for tolerance in (TOLERANCE_M, 1.0e-11, 1.0e-12):
        run, statistics = (
            FullRun(prepare(load_mechanism("andrews")), tolerance_m=tolerance),
            new_run_statistics(10),
        )
        start = run.stored_energy
        run.advance(0.03, statistics)
        t = run.q[:, 2]
        got = np.array([t[1], t[2] - t[1], t[3], t[4] - t[5], t[5], t[6] - t[7], t[7]])
        names = list(load_mechanism("andrews").joints)
        rows = {names[j]: r for j, r in zip(run.model.rows.closure, run.model.rows.row, strict=True)}
        errors = [
            np.linalg.norm(run.lam[rows[joint] : rows[joint] + 2] - force) / np.linalg.norm(force)
            for joint, force in wanted["ANDREWS_FORCES"].items()
        ]
        work = statistics.drive_integral[POWER]
        angle = np.abs(got - wanted["ANDREWS_ANGLES"]).max()
        lost = abs(run.stored_energy - start - work) / work
        row(f"{tolerance:.0e}", f"{angle:.1e}", f"{max(errors):.1e}", f"{lost:.1e}")


def slider_crank() -> None:
    wanted = case("dynamics/test_full.py")["IMPACTS"]
    print("\n### Slider-crank with clearance in the pin\n")
    table("local error [m]", "impact", "begins [ms]", "speed [m/s]", "ends [ms]", "peak [N]")
    for i, (begin, speed, end, peak) in enumerate(wanted, start=1):
        row("published", str(i), f"{begin:.5f}", f"{speed:.5f}", f"{end:.5f}", f"{peak:.0f}")
    for tolerance in (1.0e-12, TOLERANCE_M):
        run, statistics = (
            FullRun(prepare(load_mechanism("slider_crank")), tolerance_m=tolerance),
            new_run_statistics(4),
        )
        run.advance(1.5e-3, statistics)
        for i, (begin, speed, end, peak) in enumerate(statistics.impact[2, : len(wanted)], start=1):
            row(
                f"{tolerance:.0e}",
                str(i),
                f"{1e3 * begin:.5f}",
                f"{speed:.5f}",
                f"{1e3 * end:.5f}",
                f"{peak:.0f}",
            )


def restitution() -> None:
    dropped = case("contact/test_contact.py")["dropped"]
    print("\n### Delivered restitution for a requested one\n")
    laws = [name for name, law in LAWS.items() if law.form is HERTZ and name != "hertz"]
    table("requested", *laws)
    worst = 0.0
    for asked in np.arange(0.05, 0.951, 0.05):
        closed = [delivered_restitution(LAWS[law].hysteresis(asked)) for law in laws]
        integrated = [dropped(LAWS[law].hysteresis(asked)) for law in laws]
        worst = max(worst, *(abs(a - b) for a, b in zip(closed, integrated, strict=True)))
        row(f"{asked:.2f}", *(f"{e:.4f}" for e in integrated))
    print(f"\nLargest difference between the dropped mass and the closed form: {worst:.1e}.")


def archard() -> None:
    test = case("wear/test_wear.py")
    leg = load_mechanism("bionic_leg")
    size = {"bushing_radius": test["RADIUS"], "radial_clearance": test["CLEARANCE"], "width": test["WIDTH"]}
    settings = attrs.evolve(leg.clearances["G"], **size, wear_coefficient=(test["BUSHING_WEAR"], 0.0))
    contacts = compile_contacts(leg, ["G"], [settings])
    print("\n### Archard in a bushing\n")
    table(
        "slid [m]",
        "depth, closed form [um]",
        "depth, sectors [um]",
        "error",
        "half arc [deg]",
        "sectors [deg]",
    )
    for distance, *_ in test["PUBLISHED"]:
        depth, arc = test["closed_form"](distance)
        worn = test["slid"](contacts, distance, 100.5 * test["SECTOR"])[0]
        half = 0.5 * np.count_nonzero(worn) * test["SECTOR"]
        error = f"{100.0 * (worn.max() / depth - 1.0):+.3f} %"
        row(
            f"{distance:g}", f"{1e6 * depth:.4f}", f"{1e6 * worn.max():.4f}", error,
            f"{math.degrees(arc):.2f}", f"{math.degrees(half):.2f}",
        )  # fmt: skip


def ideal() -> None:
    jansen = build_linkage(load_mechanism("jansen_leg"))
    foot = point_motion(one_cycle(jansen, 8, 1.0), jansen, *jansen.mechanism.toe)[0] / 0.008 + [38.0, 7.8]
    wanted = case("mechanism/test_kinematics.py")["JANSEN_FOOT"]
    print(f"\n### Jansen\n\nLargest error of the foot: {np.abs(foot - wanted).max():.1e} of his units.")

    test = case("mechanism/test_kinematics.py")
    foot = test["klann_foot"](build_linkage(load_mechanism("klann_leg")))
    off, (height, deviation) = foot[[0, 180]] - [(1.0, 0.0), (0.0, 0.0)], test["klann_step"](foot)
    print(f"\n### Klann\n\nLargest error of the foot: {np.abs(off).max():.1e} units of the patent.")
    print(f"Height of a step {height:.2f} %, deviation from a line {deviation:.2f} %.")

    reference = json.loads((TEST / "data" / "ideal_60rpm.json").read_text())
    leg = build_linkage(load_mechanism("bionic_leg"))
    motion = one_cycle(leg, 36, TURN)
    curves = dict(
        zip(
            ("toe_m", "toe_velocity_mps", "toe_acceleration_mps2"),
            point_motion(motion, leg, *leg.mechanism.toe),
            strict=True,
        )
    )
    errors = {key: _error(curve, reference[key]) for key, curve in curves.items()}
    errors["drive_torque_nm"] = _error(motion.drive_torque, reference["drive_torque_nm"])
    force = np.linalg.norm(motion.joint_force, axis=2)
    errors["joint_force_n, worst joint"] = max(
        _error(force[:, i], reference["joint_force_n"][name]) for i, name in enumerate(leg.mechanism.joints)
    )
    print("\n### The leg with ideal joints\n")
    table("curve", "largest error over its range")
    for key, error in errors.items():
        row(key, f"{error:.1e}")


def _error(got: np.ndarray, wanted: list[float]) -> float:
    return float((np.abs(got - wanted).max(axis=0) / np.ptp(wanted, axis=0)).max())


if __name__ == "__main__":
    for section in (andrews, slider_crank, restitution, archard, ideal):
        section()
