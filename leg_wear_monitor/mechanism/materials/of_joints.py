"""Material pairs of the joints of a mechanism."""

from collections.abc import Sequence
from typing import Any

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.clearance import Clearance
from leg_wear_monitor.mechanism.materials.loader import load_material
from leg_wear_monitor.mechanism.materials.material import Material
from leg_wear_monitor.mechanism.spec import Mechanism

_BESIDE = "a value beside "  # a wear coefficient of the mechanism file, in place of the pair's


def settings_of(pair: Material) -> dict[str, Any]:
    """Settings of a clearance joint that a pair gives, as a mechanism file would have them.

    A pair without wear coefficient gives 0: the coefficient of another pair must not take its place.
    """
    given: dict[str, Any] = {"wear_coefficient": list(pair.wear_coefficients or (0.0, 0.0))}
    for key in ("youngs_modulus", "poissons_ratio"):
        sides = getattr(pair.bushing, key), getattr(pair.journal, key)
        if None not in sides:
            given[key] = [side.si for side in sides]
    if pair.friction is not None:
        given["friction"] = {"coefficient": pair.friction.si}
    return given


def lacks_wear(settings: Clearance) -> bool:
    """Whether a joint's pair gives no wear coefficient, and no value stands beside it."""
    if not settings.material or max(settings.wear_coefficient) > 0.0:
        return False
    return load_material(settings.material).wear_coefficients is None


def check_wear_is_known(mechanism: Mechanism, joints: Sequence[str]) -> None:
    """Check that there is something to compute a life from: a coefficient, or a formula of the maker.

    Raises
    ------
    ConfigError
        If the pairs of all joints have limits only; it names the first joint.
    """
    known = [mechanism.clearances[joint] for joint in joints if joint in mechanism.clearances]
    if known and all(lacks_wear(each) and load_material(each.material).rating_life is None for each in known):
        raise ConfigError(
            mechanism.source,
            f"clearances.joints.{joints[0]}.wear_coefficient",
            f"is missing for a life: {known[0].material} has no wear coefficient of both bodies, "
            "expected one beside the material [1/Pa]",
        )


def regimes(mechanism: Mechanism, joints: Sequence[str]) -> dict[str, list[str]]:
    """The joints by what their wear holds for: a pair and its regime, or a bare coefficient."""
    found: dict[str, list[str]] = {}
    for joint in joints:
        settings = mechanism.clearances[joint]
        wear = " and ".join(f"{k:.3g}" for k in dict.fromkeys(settings.wear_coefficient)) + " 1/Pa"
        wear = "not known: not counted" if lacks_wear(settings) else wear
        found.setdefault(f"{regime_of(settings)}, wear coefficient {wear}", []).append(joint)
    return found


def regime_of(settings: Clearance) -> str:
    """What a joint's wear coefficient holds for: its pair and the pair's regime."""
    if not settings.material:
        return "no material named, regime unknown"
    pair = load_material(settings.material)
    own = "" if lacks_wear(settings) or settings.wear_coefficient == pair.wear_coefficients else _BESIDE
    return f"{own}{pair.name} ({pair.regime})"


def spread_of(settings: Clearance, usual: float) -> float | None:
    """Logarithmic standard deviation of a joint's wear coefficient by its pair.

    The clearance grows by the sum of both coefficients. Both bodies are in the same regime, so their
    deviations are taken as one: their spreads count by their part of the sum.

    Parameters
    ----------
    settings : Clearance
    usual : float
        Spread of a body for which the pair gives none, while it gives one for the other.

    Returns
    -------
    float or None
        None if the pair gives no spread, or if a wear coefficient stands beside the pair.
    """
    if not settings.material:
        return None
    pair = load_material(settings.material)
    both = pair.bushing.wear_coefficient, pair.journal.wear_coefficient
    if settings.wear_coefficient != pair.wear_coefficients or not any(both):
        return None
    spreads = [side.spread if side is not None else None for side in both]
    if not any(spreads):
        return None
    known = [usual if spread is None else spread.si for spread in spreads]
    weighted = sum(k * spread for k, spread in zip(settings.wear_coefficient, known, strict=True))
    return weighted / sum(settings.wear_coefficient)
