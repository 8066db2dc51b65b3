"""A study's description as types: every key of config/studies/*.yaml, its unit, bounds and meaning."""

from pathlib import Path
from typing import Any

import attrs

from leg_wear_monitor.configuration.quantity import FieldError, described, quantity
from leg_wear_monitor.configuration.strict import structure
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.clearance import FRICTION_LAWS, NORMAL_LAWS
from leg_wear_monitor.mechanism.loader import read_yaml
from leg_wear_monitor.share import share_directory
from leg_wear_monitor.studies.plan.keys import (
    Names,
    check_sets,
    clearance_field,
    clearance_joints_field,
    clearances_field,
    count_field,
    some_of,
    speed_field,
    speeds_field,
)
from leg_wear_monitor.studies.tasks.grid import SAMPLES


@attrs.frozen(kw_only=True)
class Ensemble:
    """The runs behind each number: motion with clearance is chaotic, so one run says little."""

    runs: int = count_field("runs that differ in where they start", 2, 12)
    cycles: int = count_field("gait cycles counted in each run", 2, 20)
    skip_cycles: int = count_field("gait cycles before them", 0, 3)
    traced_cycles: int = count_field("counted cycles of each run whose curves are kept", 1, 5)
    perturb_fraction: float = quantity(
        "",
        "journals start up to this fraction of the clearance from the centre",
        at_least=0.0,
        at_most=1.0,
        default=0.3,
    )
    seed: int = count_field("of where the runs start", 0, 1)

    def __attrs_post_init__(self) -> None:
        if self.traced_cycles > self.cycles:
            raise FieldError(
                "traced_cycles", f"{self.traced_cycles} is more than the {self.cycles} cycles counted"
            )


@attrs.frozen(kw_only=True)
class Study:
    """What every study's description has."""

    mechanism: str = described("a mechanism that comes with the package, or a file", default="bionic_leg")
    ensemble: Ensemble = described("the runs behind each number", factory=Ensemble)


@attrs.frozen(kw_only=True)
class Size(Study):
    """Clearance size at chosen joints."""

    joints: Names = clearance_joints_field()
    clearances_m: tuple[float, ...] = clearances_field()
    speed_rpm: float = speed_field()


@attrs.frozen(kw_only=True)
class Speed(Study):
    """Crank speed with clearance at chosen joints."""

    joints: Names = clearance_joints_field()
    speeds_rpm: tuple[float, ...] = speeds_field()
    clearance_m: float = clearance_field()


@attrs.frozen(kw_only=True)
class Location(Study):
    """Clearance in one place or another."""

    sets: tuple[Names, ...] = described("clearance joints of one run, a list of lists", check=check_sets)
    clearance_m: float = clearance_field()
    speed_rpm: float = speed_field()


@attrs.frozen(kw_only=True)
class Multi(Location):
    """Clearance in all those places at once, against each place alone."""


@attrs.frozen(kw_only=True)
class Life:
    """How far wear is followed, and by what jumps, as in `dynamics.life`."""

    opens_m: float = quantity(
        "m",
        "opening of the mean clearance of the joint that wears fastest",
        at_least=1.0e-7,
        at_most=0.1,
        default=1.0e-4,
    )
    jump_m: float = quantity(
        "m",
        "deepest change of a surface that a jump may make",
        at_least=1.0e-9,
        at_most=0.1,
        default=1.0e-5,
    )
    cycles: int = count_field("gait cycles simulated and averaged before each jump", 2, 6)
    runs: int = count_field("lives that differ in where they start", 2, 4)


@attrs.frozen(kw_only=True)
class Wear(Location):
    """Where bushings and journals wear, fresh and after wear has fed back over a life."""

    life: Life = described("how far wear is followed", factory=Life)


@attrs.frozen(kw_only=True)
class Exponent:
    """How the largest Lyapunov exponent is measured."""

    runs: int = count_field("pairs of neighbours that differ in where they start", 2, 4)
    cycles: int = count_field("gait cycles over which neighbours are followed", 10, 100)
    renewals: int = quantity(
        "",
        "times in a cycle that the neighbour is brought back, a power of 2",
        at_least=1,
        at_most=SAMPLES,
        default=64,
        check=lambda times: None if SAMPLES % times == 0 else f"{times} does not divide {SAMPLES}",
    )
    distance: float = quantity(
        "", "distance it is brought back to, in clearances", at_least=1.0e-12, at_most=1.0e-3, default=1.0e-8
    )
    tolerance_m: float = quantity(
        "m",
        "local error allowed in a step: errors of the usual size add to the growth",
        at_least=1.0e-15,
        at_most=1.0e-6,
        default=1.0e-10,
    )


@attrs.frozen(kw_only=True)
class Bifurcation:
    """Poincaré sections over a parameter."""

    clearances_m: tuple[float, ...] = clearances_field()
    speeds_rpm: tuple[float, ...] = speeds_field()
    cycles: int = count_field("gait cycles drawn at each value", 1, 60)
    skip_cycles: int = count_field("gait cycles before them", 0, 20)


@attrs.frozen(kw_only=True)
class Chaos(Study):
    """How far the motion can be foretold."""

    joints: Names = clearance_joints_field()
    others: tuple[Names, ...] = described("other sets whose exponents are compared", default=())
    clearance_m: float = clearance_field()
    speed_rpm: float = speed_field()
    section_cycles: int = count_field("points of a Poincaré map, one a cycle", 2, 1000)
    section_crank_angle_deg: float = quantity(
        "deg", "crank angle of the map", at_least=0.0, at_most=360.0, default=0.0
    )
    exponent: Exponent = described("how the Lyapunov exponent is measured", factory=Exponent)
    bifurcation: Bifurcation = described("parameters of the diagrams")


@attrs.frozen(kw_only=True)
class Laws(Study):
    """The normal force and friction laws against each other."""

    joints: Names = clearance_joints_field()
    clearance_m: float = clearance_field()
    speed_rpm: float = speed_field()
    normal_laws: Names = described(
        "laws of the normal force", default=NORMAL_LAWS, check=some_of(NORMAL_LAWS)
    )
    friction_laws: Names = described(
        "ramps of friction, each with the mechanism's own normal law",
        default=FRICTION_LAWS,
        check=some_of(FRICTION_LAWS),
    )
    friction_coefficients: tuple[float, ...] = quantity(
        "",
        "friction coefficients, each with the mechanism's own laws",
        at_least=0.0,
        at_most=2.0,
        default=(0.02, 0.05, 0.1),
    )


STUDIES: dict[str, type[Study]] = {
    "size": Size,
    "speed": Speed,
    "location": Location,
    "wear": Wear,
    "multi": Multi,
    "chaos": Chaos,
    "laws": Laws,
}


def shipped_study(name: str) -> Path:
    """Description of a study that comes with the package."""
    return share_directory() / "config" / "studies" / f"{name}.yaml"


def load_settings(name: str, path: str | Path | None = None) -> Study:
    """Read the description of a study.

    Parameters
    ----------
    name : str
        A key of `STUDIES`.
    path : str or pathlib.Path, optional
        The one that comes with the package if not given.

    Raises
    ------
    ConfigError
        Naming file, key, value, unit and what was expected.
    """
    if name not in STUDIES:
        raise ConfigError("study", "", f"{name!r} is not one of {', '.join(STUDIES)}")
    place = shipped_study(name) if path is None else Path(path)
    source = place.name if path is None else str(path)
    return parse_settings(name, read_yaml(place, source), source)


def parse_settings(name: str, document: Any, source: str) -> Study:
    """Types from the plain mapping that a study's file holds; see `load_settings`."""
    settings: Study = structure(document, STUDIES[name], source, "")
    return settings
