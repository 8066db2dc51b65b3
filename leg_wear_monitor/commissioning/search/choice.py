"""The best candidate, its rival in each respect, and whether the rival may be the truth."""

import math
from collections.abc import Callable

import attrs

from leg_wear_monitor.commissioning.search.candidates import (
    Candidate,
    first,
    on_one_shaft,
    same_gear,
)
from leg_wear_monitor.estimate.torque_fit.likeness import repeating, too_alike
from leg_wear_monitor.mechanism.ideal import TURN

_SAME_PHASE_RAD = 0.3  # two sensors of one torque differ by their lags, those of two legs by more
_SIGNALS = ("crank_joint", "drive_torque.source")
ANOTHER_LEG = 0.5  # repeating rest beyond which nothing that fits is known


@attrs.frozen(eq=False)
class Rival:
    """The best candidate that differs in one respect.

    Attributes
    ----------
    candidate : Candidate
    doubt : str
        Why it may be the truth; empty if it cannot.
    """

    candidate: Candidate
    doubt: str = ""


@attrs.frozen(eq=False)
class Choice:
    """The best candidate and its rivals: ``joint``, ``source``, ``direction``, ``torque sign``, ``gear``."""

    best: Candidate
    rivals: dict[str, Rival]
    also: tuple[str, ...]

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why the choice is not sure; empty if it is."""
        rest = repeating(self.best.fit)
        told = [f"{name}: {rival.doubt}" for name, rival in self.rivals.items() if rival.doubt]
        if rest > ANOTHER_LEG:
            told.append(
                f"another leg: {100.0 * rest:.0f} % of the torque repeats with each turn and is not that of "
                "this mechanism, however it is turned"
            )
        return tuple(told)


def choose(found: list[Candidate]) -> Choice:
    """Choose among candidates, the best first; there is at least one."""
    best = _nearest_to_the_crank(found)
    of_pair = [each for each in found if (each.joint, each.torque) == (best.joint, best.torque)]
    respects: dict[str, tuple[list[Candidate], Callable[[Candidate], bool]]] = {
        "crank.sign": (of_pair, lambda each: each.fit.direction != best.fit.direction),
        "drive_torque.sign": (of_pair, lambda each: each.fit.torque_sign != best.fit.torque_sign),
        "crank.gear_ratio": (of_pair, lambda each: not same_gear(each.fit, best.fit)),
        "crank_joint": (found, lambda each: each.joint != best.joint),
        "drive_torque.source": (
            found,
            lambda each: each.joint == best.joint and each.torque != best.torque,
        ),
    }
    rivals, also = {}, []
    for name, (among, differs) in respects.items():
        rival = first(among, differs)
        if rival is None:
            continue
        alike = too_alike(best.fit, rival.fit, other_signal=name in _SIGNALS)
        same = alike and _is_the_same(name, best, rival)
        rivals[name] = Rival(rival, _doubt(name, best, rival) if alike and not same else "")
        if same:
            also.append(_also(name, rival))
    return Choice(best, rivals, tuple(also))


def _nearest_to_the_crank(found: list[Candidate]) -> Candidate:
    """Of joints on one shaft, which fit alike, the one with the least gear."""
    best = found[0]
    near = [
        each
        for each in found
        if each.joint != best.joint
        and too_alike(best.fit, each.fit, other_signal=True)
        and on_one_shaft(best.fit, each.fit)
        and not same_gear(each.fit, best.fit)
    ]
    return min([best, *near], key=lambda each: abs(math.log(each.fit.gear_ratio)))


def _is_the_same(name: str, best: Candidate, rival: Candidate) -> bool:
    """Whether a rival that fits as well means the same: another encoder of the shaft, another sensor."""
    if name == "crank_joint":
        return on_one_shaft(best.fit, rival.fit) and not same_gear(best.fit, rival.fit)
    if name == "drive_torque.source":
        number = best.fit.pair.recording[0].item()
        apart = best.fit.offset_rad[number] - rival.fit.offset_rad.get(number, math.inf)
        apart = abs((apart + math.pi) % TURN - math.pi) if math.isfinite(apart) else math.inf
        same = best.fit.direction == rival.fit.direction and same_gear(best.fit, rival.fit)
        return same and apart < _SAME_PHASE_RAD
    return False


def _also(name: str, rival: Candidate) -> str:
    if name == "crank_joint":
        return f"{rival.joint.joint} turns with the crank, too, at {rival.fit.gear_ratio:.6g} turns a turn"
    return f"{rival.torque.label} is the same torque"


def _doubt(name: str, best: Candidate, rival: Candidate) -> str:
    less = f"mismatch {rival.fit.mismatch:.3f} beside {best.fit.mismatch:.3f}"
    if name == "crank_joint":
        return (
            f"{best.joint.joint} and {rival.joint.joint} both turn like this leg's crank ({less}); select "
            "one with --crank-joint"
        )
    if name == "drive_torque.source":
        return (
            f"{best.torque.label} and {rival.torque.label} both fit, but not with the same offset ({less}); "
            "select one with --drive-torque"
        )
    return (
        f"the torque of this leg looks nearly the same the other way round ({less}); walk faster, where "
        "inertia shapes the torque, or turn the crank by hand and look"
    )
