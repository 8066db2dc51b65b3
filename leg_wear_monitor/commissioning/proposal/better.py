"""How each quantity could be known better than a recording shows it."""

import math
from collections.abc import Callable, Mapping

from leg_wear_monitor.commissioning.proposal.found import Found, gear

_TWO_CADENCES = "record two cadences in one recording, 40 rpm apart"


def better(name: str, found: Found) -> str:
    """What would tell a quantity better; empty where nothing has to."""
    return _WAYS[name](found) if name in _WAYS else ""


def _gear(found: Found) -> str:
    return "" if gear(found)[1] else "enter the ratio of the teeth"


def _offset(found: Found) -> str:
    by_lag = found.timing.lag_sigma_s * found.turned_radps
    if by_lag <= found.fit.error.phase_rad:
        return "turn the crank to a known angle, such as a dead centre"
    if found.timing.is_lag_separated:
        return f"{_further(found)}, or declare drive.lag_s"
    return f"{_TWO_CADENCES}, or declare drive.lag_s"


def _lag(found: Found) -> str:
    if math.isfinite(found.declared.lag_s):
        return ""
    return _further(found) if found.timing.is_lag_separated else _TWO_CADENCES


def _further(_found: Found) -> str:
    return "record cadences further apart"


def _sampling(found: Found) -> str:
    return "" if found.sampling.value else "ask the drive's manual"


def _scale(_found: Found) -> str:
    return "measure the torque of a known weight on the crank"


def _bandwidth(found: Found) -> str:
    one = found.low_pass
    if one is not None and one.is_told and not math.isfinite(one.bandwidth_hz):
        return ""
    return "declare drive.bandwidth_hz, or walk faster: stronger impacts show it better"


def _load_friction(found: Found) -> str:
    return f"declare drive.load_friction: clearances change it by {found.fit.error.load_friction:.2g}"


_WAYS: Mapping[str, Callable[[Found], str]] = {
    "crank.gear_ratio": _gear,
    "crank.offset_rad": _offset,
    "drive_torque.scale": _scale,
    "drive_torque.sampling": _sampling,
    "lag": _lag,
    "bandwidth": _bandwidth,
    "load friction": _load_friction,
}
