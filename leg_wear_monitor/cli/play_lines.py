"""A measured play as text."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from leg_wear_monitor.errors import printable

if TYPE_CHECKING:
    from leg_wear_monitor.play.result import Clearances, JointClearance, Play, PlayMeasurement


def lines(result: "PlayMeasurement", mechanism: str, encoder: str) -> Iterator[str]:
    """Lines of plays, and of the clearances of a mechanism whose joint ``encoder`` has the encoder."""
    for play in result.plays:
        if len(result.plays) > 1 or play.crank_angle_rad is not None:
            at = play.crank_angle_rad
            yield printable(play.recording) + ("" if at is None else f", crank at {math.degrees(at):g} deg")
        yield from _play(play)
    if result.clearances is not None:
        yield ""
        yield (
            f"mean radial clearances of {printable(mechanism)}, if the pushes turn joint {encoder} and other "
            "joints are ideal:"
        )
        yield from _clearances(result.clearances)


def _play(play: "Play") -> Iterator[str]:
    up, down = play.plateaus
    name, sigma = printable(play.joint), _angle(play.sigma_rad)
    counts = play.play_rad / play.count_rad
    yield f"{name}: play {_angle(play.play_rad)}, standard deviation {sigma}; {counts:.3g} counts"
    yield f"  side by {printable(play.load) or 'the angle itself'}; {up} and {down} pushes count"
    turn = 2.0 * math.pi / play.count_rad
    yield f"  count of the encoder {_angle(play.count_rad)}, {turn:.5g} per turn"
    yield f"  noise {_angle(play.noise_rad)}, scatter of the repeats {_angle(play.scatter_rad)}"
    for label, texts in (("doubtful", play.findings), ("note", play.notes)):
        for text in texts:
            yield f"{label}: {printable(text)}"


def _clearances(found: "Clearances") -> Iterator[str]:
    for one in found.joints:
        if one.clearance_m is not None and one.sigma_m is not None:
            mm, sigma = f"{1e3 * one.clearance_m:.4f}", f"{max(1e3 * one.sigma_m, 1e-4):.4f}"
            yield f"  {one.joint}: {mm} mm, standard deviation {sigma} mm"
            if float(mm) > 0.0:
                yield f"     leg-wear-monitor measure {one.joint} {mm} --sigma {sigma}"
        elif one.most_m is None:
            yield f"  {one.joint}: has no effect on this encoder"
    together = [one for one in found.joints if one.joint in found.not_told_apart]
    if together:
        names = ", ".join(map(_at_most, together))
        yield f"not told apart: {names}; measure in further postures or with another encoder"
    for text in found.findings:
        yield f"doubtful: {printable(text)}"


def _at_most(one: "JointClearance") -> str:
    return f"{one.joint} (at most {1e3 * (one.most_m or 0.0):.3g} mm)"


def _angle(value_rad: float) -> str:
    return f"{1e3 * value_rad:.3g} mrad ({math.degrees(value_rad):.3g} deg)"
