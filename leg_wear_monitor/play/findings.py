"""What makes a measured play doubtful, and further information on it."""

from leg_wear_monitor.play.fit import MANY
from leg_wear_monitor.play.result import Play

EXCESS = 3.0  # times what count and noise explain


def findings(play: Play, expected_rad: float) -> tuple[str, ...]:
    """Findings of a play, with the remedy.

    Parameters
    ----------
    play : Play
    expected_rad : float
        Standard deviation of a plateau that count and noise explain.
    """
    return tuple(_findings(play, expected_rad))


def _findings(play: Play, expected_rad: float) -> list[str]:
    found = []
    pushes = sum(play.plateaus) + play.moving + play.short + play.outside
    if play.scatter_rad > EXCESS * expected_rad:
        found.append(
            f"the repeats scatter by {_mrad(play.scatter_rad)}, count and noise explain "
            f"{_mrad(expected_rad)}: stiction stops the joint short of its end, or the pushes bend the leg "
            "by different amounts; push harder and longer, or always alike"
        )
    if play.short > MANY * pushes:
        found.append(
            f"in {play.short} of {pushes} pushes the joint stopped short of its end (stiction): push harder"
        )
    if play.moving > MANY * pushes:
        found.append(f"in {play.moving} of {pushes} pushes the angle still moved at the end: hold longer")
    if play.sigma_rad > 0.5 * play.play_rad:
        found.append(
            f"the play of {_mrad(play.play_rad)} is less than two standard deviations "
            f"({_mrad(play.sigma_rad)}): it is not resolved"
        )
    return found


def notes(play: Play) -> tuple[str, ...]:
    """Notes on a play: the drift that was removed, the pushes that were left out."""
    told = []
    if play.drift_rad > play.count_rad:
        told.append(f"the angle drifted by {_mrad(play.drift_rad)} during the pushes; the drift is removed")
    for number, what in (
        (play.moving, "the angle still moved at the end"),
        (play.short, "the joint stopped short of its end"),
        (play.outside, "the angle went beyond the others"),
    ):
        if number:
            told.append(f"{_pushes(number)} left out: {what}")
    if play.sprung:
        told.append(
            f"in {_pushes(play.sprung)} the joint sprang back while the signal kept its value; its outermost "
            "rest counts"
        )
    if not play.load:
        told.append(
            "without a load signal, the play is the distance between the places where the joint rests: a "
            "joint that rests before its end has more"
        )
    return tuple(told)


def _pushes(number: int) -> str:
    return f"{number} {'push' if number == 1 else 'pushes'}"


def _mrad(value_rad: float) -> str:
    return f"{1e3 * value_rad:.3g} mrad"
