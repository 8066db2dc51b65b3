"""How long both models go the same way: a table of validation_clearance.md, and decorrelation.png.

From the same ideal start at 60 rpm: full against clearance coordinates, and two runs in full coordinates
whose clearances differ by a nanometre. A minute on one core.
"""

from pathlib import Path

import numpy as np

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceRun
from leg_wear_monitor.dynamics.run import BEGIN, Run, new_run_statistics
from leg_wear_monitor.dynamics.simulation import MODELS, prepare
from leg_wear_monitor.mechanism.position import rotated
from leg_wear_monitor.report import figure as drawing

LEGS, SETS = ("bionic_leg", "jansen_leg"), ("AB", "G", "IJ", "ABGIJ")
CLEARANCE, APART = 3.0e-4, 1.0e-9  # m: of all joints, and by what two runs in full coordinates differ
FAR = 0.1  # of the clearance: motions so far apart have nothing to do with each other
PICTURE = Path(__file__).parents[1] / "appendix" / "decorrelation.png"


class Watched:
    """A run of either model, looked at from time to time."""

    def __init__(self, name: str, clearance_joints: str, model: str, clearance_m: float = CLEARANCE) -> None:
        mechanism = load_mechanism(name)
        self.setup = prepare(mechanism, clearances=tuple(clearance_joints), clearance_m=clearance_m)
        self.joints, self.statistics = self.setup.contacts.joint, new_run_statistics(len(mechanism.joints))
        self.run: Run = MODELS[model](self.setup, 10_000)  # both can be looked at every 0.1 ms

    def advance(self, t: float) -> np.ndarray:
        """Eccentricities (k, 2) at a time [m]."""
        self.run.advance(t, self.statistics)
        if isinstance(self.run, ClearanceRun):
            return self.run.stepper.state.e.reshape(-1, 2).copy()
        arrays, q = self.setup.linkage.arrays, self.run.q
        bodies, points = arrays.joint_body[self.joints], arrays.joint_point[self.joints]
        bushing, journal = (
            [q[b, :2] + rotated(point, q[b, 2]) for b, point in zip(bodies[:, i], points[:, i], strict=True)]
            for i in range(2)
        )
        return np.array(journal) - np.array(bushing)

    def begun(self) -> np.ndarray:
        """Times at which impacts have begun in any joint [s]."""
        begins = [self.statistics.impact[j, : self.statistics.impacts[j], BEGIN] for j in self.joints]
        return np.sort(np.concatenate(begins))


def distances(one: Watched, other: Watched, times: np.ndarray) -> np.ndarray:
    """How far journals are from where the other run has them, the worst of all joints (n,) [m]."""
    return np.array([np.linalg.norm(one.advance(t) - other.advance(t), axis=1).max() for t in times])


def first_far(one: Watched, other: Watched, seconds: float) -> float:
    """Time at which journals are far apart [s], inf if they never are."""
    for t in np.arange(1, round(seconds * 1e3) + 1) * 1.0e-3:
        if distances(one, other, [t])[0] > FAR * CLEARANCE:
            return float(t)
    return np.inf


def decorrelation(seconds: float) -> None:
    print(
        "| leg | clearance joints | first impact [ms] | models apart after [ms] | impacts by then "
        "| chaos alone [ms] |"
    )
    print("| --- | --- | --- | --- | --- | --- |")
    for name in LEGS:
        for clearance_joints in SETS:
            full = Watched(name, clearance_joints, "full")
            after = first_far(full, Watched(name, clearance_joints, "clearance"), seconds)
            begun = full.begun()
            pair = (Watched(name, clearance_joints, "full", CLEARANCE + i * APART) for i in range(2))
            chaos = first_far(*pair, seconds)
            cells = (
                f"{1e3 * begun[0]:.1f}",
                f"{1e3 * after:.0f}",
                str((begun < after).sum()),
                f"{1e3 * chaos:.0f}",
            )
            print(f"| {name} | {', '.join(clearance_joints)} | {' | '.join(cells)} |", flush=True)


def picture(path: Path) -> None:
    """Contact force in A from both models, and how far apart their journals are."""
    times = np.arange(1, 801) * 1.0e-4
    name, clearance_joints = LEGS[0], "ABGIJ"
    figure = drawing.new_figure(7.0, 4.6)
    top, bottom = figure.subplots(2, sharex=True)
    for model, colour, width in (("full", drawing.ORANGE, 1.8), ("clearance", drawing.BLUE, 0.9)):
        watched, force = Watched(name, clearance_joints, model), []
        for t in times:
            watched.advance(t)
            force.append(watched.run.sample().force[watched.joints[0]])
        top.plot(1e3 * times, force, color=colour, linewidth=width, label=f"{model} coordinates")
    pairs = {
        "full and clearance coordinates": (
            Watched(name, clearance_joints, "full"),
            Watched(name, clearance_joints, "clearance"),
        ),
        "full coordinates, clearances 1 nm apart": [
            Watched(name, clearance_joints, "full", CLEARANCE + i * APART) for i in range(2)
        ],
    }
    for (label, pair), colour in zip(pairs.items(), (drawing.INK, drawing.VERMILION), strict=True):
        far = 1e6 * distances(*pair, times)
        bottom.plot(1e3 * times, np.maximum(far, 1e-6), color=colour, linewidth=1.0, label=label)
    bottom.axhline(1e6 * CLEARANCE, color=drawing.BLUE, linewidth=0.8, linestyle=":")
    bottom.annotate("clearance", (1.0, 1.3e6 * CLEARANCE), fontsize=drawing.SMALL)
    bottom.set(yscale="log", ylim=(1e-6, 2e3), xlim=(0.0, 80.0), yticks=10.0 ** np.arange(-6, 4, 2))
    bottom.minorticks_off()
    top.set_ylabel("contact force in A [N]", fontsize=drawing.SMALL)
    bottom.set_xlabel("time from the ideal start [ms]", fontsize=drawing.SMALL)
    bottom.set_ylabel("journals apart by [µm], worst joint", fontsize=drawing.SMALL)
    for axes, place in ((top, "upper right"), (bottom, "lower right")):
        axes.legend(fontsize=drawing.SMALL, frameon=False, loc=place)
        drawing.tidy(axes)
    path.write_bytes(drawing.png(figure, 110.0))


if __name__ == "__main__":
    picture(PICTURE)
    decorrelation(2.0)
