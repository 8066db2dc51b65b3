"""Load of a bushing, p, v and p v, against the limits of its material pair."""

from typing import Any

import attrs

from leg_wear_monitor.mechanism.clearance import Clearance
from leg_wear_monitor.mechanism.materials.loader import load_material
from leg_wear_monitor.mechanism.spec import Mechanism


def _si(unit: str, default: Any = attrs.NOTHING) -> Any:
    return attrs.field(default=default, metadata={"unit": unit})


@attrs.frozen
class Excess:
    """A load beyond a limit.

    Attributes
    ----------
    name : str
        ``p``, ``v`` or ``p v``.
    value, limit : float
    unit : str
        Of both.
    """

    name: str
    value: float
    limit: float
    unit: str

    def __str__(self) -> str:
        return f"{self.name} {self.value:.3g} {self.unit} above {self.limit:.3g}"


@attrs.frozen(kw_only=True)
class BushingLoad:
    """Pressure and sliding speed in a joint over a gait cycle, and the limits of its material.

    The 99th percentile of the pressure and the means of the others are held against the limits: makers limit
    the speed and the product because they heat the bushing.

    Attributes
    ----------
    mean_pressure_pa : float
        Mean force over the projected area of the bushing, its diameter times its width.
    p99_pressure_pa : float
        Pressure that is not exceeded 99 % of the time.
    mean_sliding_speed_mps : float
        Sliding speed under load: its mean weighted by the force.
    mean_pressure_speed_pa_mps : float
        Mean of pressure times sliding speed.
    pressure_limit_pa : float or None
        Limit of the pressure; None where the material gives none, like the next two.
    sliding_speed_limit_mps : float or None
        Limit of the sliding speed.
    pressure_speed_limit_pa_mps : float or None
        Limit of their product.
    outside_limits : str or None
        What is beyond the limits, so that the wear coefficient does not hold; None within them.
    """

    mean_pressure_pa: float = _si("Pa")
    p99_pressure_pa: float = _si("Pa")
    mean_sliding_speed_mps: float = _si("m/s")
    mean_pressure_speed_pa_mps: float = _si("Pa m/s")
    pressure_limit_pa: float | None = _si("Pa", None)
    sliding_speed_limit_mps: float | None = _si("m/s", None)
    pressure_speed_limit_pa_mps: float | None = _si("Pa m/s", None)
    outside_limits: str | None = None

    @property
    def compared(self) -> tuple[Excess, ...]:
        """Every value that has a limit, beyond it or not."""
        limited = (
            ("p", self.p99_pressure_pa, self.pressure_limit_pa, "Pa"),
            ("v", self.mean_sliding_speed_mps, self.sliding_speed_limit_mps, "m/s"),
            ("p v", self.mean_pressure_speed_pa_mps, self.pressure_speed_limit_pa_mps, "Pa m/s"),
        )
        return tuple(
            Excess(name, value, limit, unit) for name, value, limit, unit in limited if limit is not None
        )

    @property
    def excesses(self) -> tuple[Excess, ...]:
        """Values beyond their limits."""
        return tuple(each for each in self.compared if each.value > each.limit)

    @property
    def fraction(self) -> float | None:
        """Largest value as a fraction of its limit; None without limits."""
        return max((each.value / each.limit for each in self.compared), default=None)


@attrs.frozen(kw_only=True)
class Bushing:
    """What a bushing's load follows from, and its limits.

    Attributes
    ----------
    area_m2 : float
        Projected area: diameter times width.
    material : str
        Its pair; empty if none is named.
    pressure_pa, sliding_speed_mps, pressure_speed_pa_mps : float or None
        Limits of the pair; None where it gives none.
    """

    area_m2: float
    material: str = ""
    pressure_pa: float | None = None
    sliding_speed_mps: float | None = None
    pressure_speed_pa_mps: float | None = None

    @classmethod
    def of(cls, settings: Clearance, *, is_swinging: bool = True) -> "Bushing":
        """The bushing of a joint with these settings; of the crank's joints, which turn, not swinging."""
        area = 2.0 * settings.bushing_radius * settings.width
        if not settings.material:
            return cls(area_m2=area)
        limits = load_material(settings.material).limits
        pressure = limits.dynamic_pressure or limits.static_pressure
        speed = (limits.oscillating_speed if is_swinging else None) or limits.sliding_speed
        return cls(
            area_m2=area,
            material=settings.material,
            pressure_pa=pressure.si if pressure else None,
            sliding_speed_mps=speed.si if speed else None,
            pressure_speed_pa_mps=limits.pressure_speed.si if limits.pressure_speed else None,
        )

    def load(self, mean_force_n: float, p99_force_n: float, rubbing_w: float) -> BushingLoad:
        """Load by forces [N] and by the mean of the normal force times the sliding speed [W]."""
        return self.loaded(
            mean_force_n / self.area_m2,
            p99_force_n / self.area_m2,
            rubbing_w / mean_force_n if mean_force_n > 0.0 else 0.0,
            rubbing_w / self.area_m2,
        )

    def loaded(
        self, mean_pressure_pa: float, p99_pressure_pa: float, speed_mps: float, pressure_speed: float
    ) -> BushingLoad:
        """Load by pressures [Pa], sliding speed [m/s] and their product [Pa m/s]."""
        load = BushingLoad(
            mean_pressure_pa=mean_pressure_pa,
            p99_pressure_pa=p99_pressure_pa,
            mean_sliding_speed_mps=speed_mps,
            mean_pressure_speed_pa_mps=pressure_speed,
            pressure_limit_pa=self.pressure_pa,
            sliding_speed_limit_mps=self.sliding_speed_mps,
            pressure_speed_limit_pa_mps=self.pressure_speed_pa_mps,
        )
        if not load.excesses:
            return load
        beyond = ", ".join(map(str, load.excesses))
        return attrs.evolve(load, outside_limits=f"outside the limits of {self.material}: {beyond}")


def bushing_of(mechanism: Mechanism, joint: str) -> Bushing:
    """The bushing of a joint: those of the crank turn, others swing."""
    is_swinging = mechanism.drive.body not in mechanism.sides(joint)
    return Bushing.of(mechanism.clearances[joint], is_swinging=is_swinging)
