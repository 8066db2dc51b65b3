"""A study: one YAML file with the settings of its points, the values that vary, and the results to keep."""

import hashlib
import json
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import attrs

from leg_wear_monitor.configuration import FieldError, described, quantity
from leg_wear_monitor.configuration.strict import structure
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.mechanism import FRICTION_LAWS, NORMAL_LAWS
from leg_wear_monitor.mechanism.loader import is_file_name, read_yaml
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.studies.tasks import SAMPLES, TASKS, code_digest

Names = tuple[str, ...]
_MOST = 1_000_000  # largest number of runs, cycles or points


def _rising(values: tuple[float, ...]) -> str | None:
    if all(a < b for a, b in pairwise(values)):
        return None
    return f"{list(values)} does not increase from value to value"


def _distinct(names: Names) -> str | None:
    return None if len(set(names)) == len(names) else f"{list(names)} names a joint twice"


def _joint_sets(sets: tuple[Names, ...]) -> str | None:
    return next((fault for fault in map(_distinct, sets) if fault), None)


def _some_of(known: Sequence[str]) -> Callable[[Names], str | None]:
    def fault(names: Names) -> str | None:
        unknown = [name for name in names if name not in known]
        return f"{unknown[0]!r} is not one of {', '.join(known)}" if unknown else None

    return fault


_count = partial(quantity, "")
_values = partial(quantity, default=(), check=_rising)


@attrs.frozen(kw_only=True)
class Ensemble:
    """The runs behind a point's statistics: motion with clearance is chaotic, so one run says little."""

    runs: int = _count("runs with different initial conditions", within=(2, _MOST), default=12)
    cycles: int = _count("gait cycles of each run that the results use", within=(2, _MOST), default=20)
    skip_cycles: int = _count("gait cycles before these", within=(0, _MOST), default=3)
    traced_cycles: int = _count(
        "gait cycles of each run whose curves are stored", within=(1, _MOST), default=5
    )
    perturb_fraction: float = _count(
        "largest distance of a journal from the centre at the start, as a fraction of the clearance",
        within=(0.0, 1.0),
        default=0.3,
    )
    seed: int = _count("seed of the initial conditions", within=(0, _MOST), default=1)

    def __attrs_post_init__(self) -> None:
        if self.traced_cycles > self.cycles:
            raise FieldError(
                "traced_cycles", f"{self.traced_cycles} is more than the {self.cycles} cycles of a run"
            )


@attrs.frozen(kw_only=True)
class ExponentSettings:
    """How the largest Lyapunov exponent is measured."""

    runs: int = _count("pairs of neighbours with different initial conditions", within=(2, _MOST), default=4)
    cycles: int = _count(
        "gait cycles over which the distance of neighbours is followed", within=(10, _MOST), default=100
    )
    renewals: int = _count(
        "renormalisations of the distance per cycle, a power of 2",
        within=(1, SAMPLES),
        default=64,
        check=lambda times: None if SAMPLES % times == 0 else f"{times} does not divide {SAMPLES}",
    )
    distance: float = _count(
        "distance after renormalisation, in clearances", within=(1.0e-12, 1.0e-3), default=1.0e-8
    )
    tolerance_m: float = quantity(
        "m",
        "local error allowed in a step; larger errors, such as the "
        "default of simulate, increase the exponent",
        within=(1.0e-15, 1.0e-6),
        default=1.0e-10,
    )


@attrs.frozen(kw_only=True)
class SectionSettings:
    """How long the motion is observed once per gait cycle."""

    cycles: int = _count("gait cycles of the section, one point per cycle", within=(2, _MOST), default=60)
    skip_cycles: int = _count("gait cycles before these", within=(0, _MOST), default=20)
    portrait_cycles: int = _count("gait cycles of a phase portrait", within=(0, 100), default=0)
    crank_angle_deg: float = quantity("deg", "crank angle of the section", within=(0.0, 360.0), default=0.0)


@attrs.frozen(kw_only=True)
class Point:
    """One point of a study.

    Attributes
    ----------
    label : str
        Name of the point in figures and tables; the result does not depend on it.
    task : str
        Computation, a key of `leg_wear_monitor.studies.tasks.TASKS`.
    settings : dict
        All that the computation depends on besides mechanism and code, including the seed.
    """

    label: str
    task: str
    settings: dict[str, Any]

    @property
    def clearance_m(self) -> float:
        """Radial clearance of the clearance joints [m]."""
        return float(self.settings["clearance_m"])

    def key(self, mechanism: Mechanism) -> str:
        """Digest of everything the result depends on: task, settings, mechanism and code."""
        plain = json.dumps([self.task, self.settings], sort_keys=True, allow_nan=False)
        leg = repr(attrs.evolve(mechanism, source=""))  # the same leg from a different file has the same key
        return hashlib.sha256("\n".join((plain, leg, code_digest())).encode()).hexdigest()[:20]


VARIED: dict[str, Callable[[Any], str]] = {
    "clearances": ", ".join,
    "clearance_m": lambda value: f"{1.0e3 * value:g} mm",
    "speed_rpm": lambda value: f"{value:g} rpm",
    "ground_n": lambda value: f"{value:g} N",
    "normal_law": str,
    "friction": lambda value: f"friction {value}",
    "friction_coefficient": lambda value: f"friction coefficient {value:g}",
}


@attrs.frozen(kw_only=True)
class Sweep:
    """One point per value of the setting that varies, and the results to keep; without values, one point."""

    clearances: tuple[Names, ...] = described("clearance joints of a point", default=(), check=_joint_sets)
    clearance_m: tuple[float, ...] = _values("m", "radial clearances", within=(1.0e-6, 0.1))
    speed_rpm: tuple[float, ...] = _values("rpm", "speeds of the crank", within=(0.1, 10_000.0))
    ground_n: tuple[float, ...] = _values(
        "N", "largest vertical forces of the ground on the toe; 0 in the air", within=(0.0, 10_000.0)
    )
    normal_law: Names = described("laws of the normal force", default=(), check=_some_of(NORMAL_LAWS))
    friction: Names = described("laws of friction", default=(), check=_some_of(FRICTION_LAWS))
    friction_coefficient: tuple[float, ...] = _values("", "friction coefficients", within=(0.0, 2.0))
    keep: Names = described(
        f"results to store for each point: {', '.join(TASKS)}",
        default=("response",),
        check=_some_of(tuple(TASKS)),
    )

    def __attrs_post_init__(self) -> None:
        if len(self.varied) > 1:
            raise FieldError("", f"varies {' and '.join(self.varied)}. Expected one setting per sweep")

    @property
    def varied(self) -> list[str]:
        """The setting that varies; empty without one."""
        return [name for name in VARIED if getattr(self, name)]


@attrs.frozen(kw_only=True)
class Study:
    """Settings of a study, as its file has them."""

    title: str = described("title of the page")
    question: str = described("question that the study answers")
    mechanism: str = described("a mechanism that comes with the package, or a file", default="bionic_leg")
    clearances: Names = described(
        "joints with clearance, unless a sweep varies them", default=(), check=_distinct
    )
    clearance_m: float = quantity(
        "m", "radial clearance of these joints", within=(1.0e-6, 0.1), default=3.0e-4
    )
    speed_rpm: float = quantity(
        "rpm",
        "speed of the crank, in the direction of the mechanism's drive",
        within=(0.1, 10_000.0),
        default=60.0,
    )
    sweeps: tuple[Sweep, ...] = described("settings that vary, one at a time")
    ensemble: Ensemble = described("the runs of each point", factory=Ensemble)
    exponent: ExponentSettings = described("the Lyapunov exponent", factory=ExponentSettings)
    section: SectionSettings = described("Poincaré section of each value", factory=SectionSettings)
    portrait: SectionSettings = described("Poincaré map and phase portrait", factory=SectionSettings)

    def points(self) -> list[Point]:
        """Points to compute, in display order; those with equal keys are computed once."""
        base = {"clearances": self.clearances, "clearance_m": self.clearance_m, "speed_rpm": self.speed_rpm}
        points = []
        for sweep in self.sweeps:
            for varied in sweep.varied or ["clearances"]:
                for value in getattr(sweep, varied) or (self.clearances,):
                    run = base | {varied: value}
                    points += [self._point(VARIED[varied](value), task, run) for task in sweep.keep]
        return points

    def _point(self, label: str, task: str, run: dict[str, Any]) -> Point:
        own = self.ensemble if task == "response" else getattr(self, task)
        start = {"seed": self.ensemble.seed, "perturb_fraction": self.ensemble.perturb_fraction}
        before = {"skip_cycles": self.ensemble.skip_cycles} if task == "exponent" else {}
        settings = run | {"clearances": list(run["clearances"])} | start | before | attrs.asdict(own)
        return Point(label=label, task=task, settings=settings)


def read_study(name: str | Path) -> Study:
    """Read the description of a study: one that comes with the package, by name, or a file.

    Raises
    ------
    ConfigError
        If a value is invalid; the message names file, key, value, unit and expectation.
    """
    if is_file_name(name):
        return parse_study(read_yaml(Path(name), str(name)), str(name))
    path = share_directory() / "config" / "studies" / f"{name}.yaml"
    if not path.is_file():
        known = ", ".join(sorted(one.stem for one in path.parent.glob("*.yaml")))
        raise ConfigError("study", "", f"{str(name)!r} is neither a file nor one of {known}")
    return parse_study(read_yaml(path, path.name), path.name)


def parse_study(document: Any, source: str) -> Study:
    """Convert the plain mapping of a study's file to typed settings; see `read_study`."""
    return structure(document, Study, source, "")
