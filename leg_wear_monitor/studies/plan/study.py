"""Base classes of studies: question, settings, points."""

from collections.abc import Callable
from typing import ClassVar

import attrs

from leg_wear_monitor.configuration.quantity import FieldError, described, quantity
from leg_wear_monitor.studies.plan.keys import count_field
from leg_wear_monitor.studies.point import Point


@attrs.frozen(kw_only=True)
class Ensemble:
    """The runs behind each number: motion with clearance is chaotic, so one run says little."""

    runs: int = count_field("runs with different initial conditions", 2, 12)
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
    seed: int = count_field("seed of the initial conditions", 0, 1)

    def __attrs_post_init__(self) -> None:
        if self.traced_cycles > self.cycles:
            raise FieldError(
                "traced_cycles", f"{self.traced_cycles} is more than the {self.cycles} cycles counted"
            )


@attrs.frozen
class Sweep:
    """A study over one quantity; its page draws every statistic over it.

    Attributes
    ----------
    quantity : str
        Name of the quantity in sentences and tables.
    axis : str
        Label of the axis, with unit.
    value : callable
        Value of a point on that axis.
    """

    quantity: str
    axis: str
    value: Callable[[Point], float]


@attrs.frozen(kw_only=True)
class Study:
    """Settings of a study; its subclasses are the studies, one file each in `plan.kinds`.

    Attributes
    ----------
    title, question : str
        Head of its page.
    sweep : Sweep or None
        For a study over one quantity: its page follows from it. Another study has a page of its own in
        `report.study.page`.
    """

    title: ClassVar[str]
    question: ClassVar[str]
    sweep: ClassVar[Sweep | None] = None

    mechanism: str = described("a mechanism that comes with the package, or a file", default="bionic_leg")
    ensemble: Ensemble = described("the runs of each point", factory=Ensemble)

    def check(self) -> None:
        """Check what the study needs beside valid settings.

        Raises
        ------
        ConfigError
            If something is missing.
        """

    def points(self) -> list[Point]:
        """Points to compute, in display order; duplicates are allowed."""
        raise NotImplementedError
