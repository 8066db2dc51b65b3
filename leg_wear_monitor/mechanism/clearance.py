"""Settings of a revolute clearance joint: geometry, material, contact laws and wear."""

from typing import Annotated, Any

import attrs

from leg_wear_monitor.configuration.quantity import USUAL, FieldError, choice, described, quantity
from leg_wear_monitor.mechanism.law_names import FRICTION_LAWS, NORMAL_LAWS

Pair = Annotated[tuple[float, float], "bushing, journal"]  # in a file, one number stands for both


def _rises(ramp: tuple[float, float]) -> str | None:
    if ramp[0] <= ramp[1] and ramp[1] > 0.0:
        return None
    return f"{list(ramp)} m/s does not rise to above 0 m/s"


@attrs.frozen(kw_only=True)
class Friction:
    """Coulomb friction with a ramp around zero slip speed."""

    law: str = choice(FRICTION_LAWS, "shape of the ramp", default="ambrosio")
    coefficient: float = quantity("", "friction coefficient", at_least=0.0, at_most=2.0, default=0.0)
    ramp: tuple[float, float] = quantity(
        "m/s",
        "slip speeds where friction begins and is full",
        at_least=0.0,
        default=(0.001, 0.01),
        check=_rises,
    )


FILM_WIDTHS = 0.125, 1.0  # width over the bushing's diameter for which the film's force is known


@attrs.frozen(kw_only=True)
class Film:
    """Oil or grease between journal and bushing."""

    viscosity_pa_s: float = quantity("Pa s", "dynamic viscosity", above=0.0)
    roughness_m: float = quantity(
        "m", "thickness below which the film resists no more than there; below the clearance", above=0.0
    )


def _length_slip(metres: float) -> str:
    return f"{USUAL}; {'mm' if metres > 1.0e-3 else 'km'} for m?"


def _modulus_slip(modulus: float) -> str:
    meant = "GPa" if modulus < 1.0e4 else "MPa" if modulus < 1.0e6 else "kPa"
    return f"{USUAL}, steel has 2.1e11; {meant} for Pa?"


@attrs.frozen(kw_only=True)
class Clearance:
    """Settings of a revolute clearance joint; pairs are (bushing, journal)."""

    bushing_radius: float = quantity(
        "m", "radius of the bushing", above=0.0, at_most=1.0, usual=(1.0e-4, 0.25), doubt=_length_slip
    )
    width: float = quantity(
        "m", "axial contact width", above=0.0, at_most=1.0, usual=(1.0e-4, 0.5), doubt=_length_slip
    )
    radial_clearance: float = quantity("m", "bushing radius less journal radius", above=0.0)
    youngs_modulus: Pair = quantity(
        "Pa", "Young's modulus", above=0.0, usual=(1.0e6, 2.0e12), doubt=_modulus_slip
    )
    poissons_ratio: Pair = quantity("", "Poisson's ratio", at_least=0.0, at_most=0.5)
    normal_law: str = choice(NORMAL_LAWS, "law of the normal force", default="lankarani-nikravesh")
    restitution: float = quantity("", "coefficient of restitution", above=0.0, at_most=1.0, default=0.9)
    friction: Friction = described("friction, a mapping of the keys below", default=Friction())
    film: Film | None = described("oil or grease, a mapping of the keys below", default=None)
    wear_coefficient: Pair = quantity(
        "1/Pa",
        "K/H of Archard's law",
        at_least=0.0,
        usual=(0.0, 1.0e-9),
        doubt=f"{USUAL}; K for K/H, or 1/MPa for 1/Pa?",
        default=(0.0, 0.0),
    )
    stiffness: float | None = quantity(
        "N/m^1.5", "contact stiffness instead of Hertz's", above=0.0, usual=(1.0e6, 1.0e14), default=None
    )
    approach_speed_floor: float = quantity(
        "m/s", "least approach speed in the damping of the normal law", above=0.0, default=1.0e-3
    )
    material: str = described(
        "material pair, which gives Young's moduli, Poisson's ratios, friction and wear coefficient that it "
        "knows; values beside it come first",
        default="",
        in_repr=False,
    )

    def __attrs_post_init__(self) -> None:
        if not self.radial_clearance < self.bushing_radius:
            raise FieldError(
                "radial_clearance",
                f"{self.radial_clearance!r} is not below the bushing_radius of {self.bushing_radius!r} m",
            )
        if self.film is not None:
            self._check_film(self.film)

    def _check_film(self, film: Film) -> None:
        if not self.radial_clearance > film.roughness_m:
            raise FieldError(
                "radial_clearance",
                f"{self.radial_clearance!r} is not above the film's roughness_m of {film.roughness_m!r} m",
            )
        least, most = (2.0 * self.bushing_radius * ratio for ratio in FILM_WIDTHS)
        if not least * (1.0 - 1.0e-9) <= self.width <= most * (1.0 + 1.0e-9):
            raise FieldError(
                "width",
                f"{self.width!r} m with a film, whose force is known from {least:g} to {most:g} m, "
                "an eighth of the bushing's diameter to the whole",
            )

    @property
    def journal_radius(self) -> float:
        """Radius of the journal [m]."""
        return self.bushing_radius - self.radial_clearance


@attrs.frozen(kw_only=True)
class ClearanceSection:
    """The section ``clearances`` of a mechanism file."""

    defaults: dict[str, Any] = described("settings of all joints, a mapping of the keys below", factory=dict)
    joints: tuple[str, ...] | dict[str, Any] = described(
        "the clearance joints: a list of names, or a mapping from each name to its own settings", default=()
    )
