"""Results of a play measurement: plays, and the clearances that they come from."""

from typing import Any

import attrs

from leg_wear_monitor.json_text import json_text

SCHEMA_VERSION = 1


@attrs.frozen(kw_only=True)
class Play:
    """Play of a joint in one posture.

    Attributes
    ----------
    joint : str
        Name of the angle.
    load : str
        Signal that gave the side; empty if the angle itself did.
    play_rad : float
        Distance between the plateaus on both sides of the load's reversals.
    sigma_rad : float
        Standard uncertainty of the play, from the scatter of the repeats and the encoder's count.
    count_rad : float
        Count of the encoder.
    noise_rad : float
        Standard deviation of the angle within a plateau.
    scatter_rad : float
        Standard deviation between the plateaus of a side.
    drift_rad : float
        Range of the drift that was removed.
    plateaus : tuple of int
        Plateaus that count, on either side.
    moving : int
        Pushes left out because the angle still moved at their end.
    short : int
        Pushes left out because the angle stopped short of the others.
    outside : int
        Pushes left out because the angle went beyond the others.
    sprung : int
        Pushes that the load signal held, while the joint had sprung back; their outermost rest counts.
    findings : tuple of str
        What makes the result doubtful, and the remedy.
    notes : tuple of str
        Further information.
    recording : str
        What was measured from; empty for arrays.
    crank_angle_rad : float, optional
        Crank angle of the posture; null if it was not given.
    """

    joint: str
    load: str
    play_rad: float
    sigma_rad: float
    count_rad: float
    noise_rad: float
    scatter_rad: float
    drift_rad: float
    plateaus: tuple[int, int]
    moving: int = 0
    short: int = 0
    outside: int = 0
    sprung: int = 0
    findings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    recording: str = ""
    crank_angle_rad: float | None = None


@attrs.frozen(kw_only=True)
class JointClearance:
    """Clearance of a joint as plays show it.

    Attributes
    ----------
    joint : str
        Name of the joint in the mechanism.
    rad_per_m : tuple of float
        Play that a meter of radial clearance gives, in each posture.
    clearance_m : float, optional
        Mean radial clearance; null if the plays do not tell it from others.
    sigma_m : float, optional
        Its standard deviation.
    most_m : float, optional
        Largest clearance that the plays allow; null if the joint has no effect on the encoder.
    """

    joint: str
    rad_per_m: tuple[float, ...]
    clearance_m: float | None = None
    sigma_m: float | None = None
    most_m: float | None = None


@attrs.frozen(kw_only=True)
class Clearances:
    """Clearances of the clearance joints.

    Attributes
    ----------
    joints : tuple of JointClearance
        The clearance joints, one by one.
    findings : tuple of str
        What does not fit.
    """

    joints: tuple[JointClearance, ...]
    findings: tuple[str, ...] = ()

    @property
    def not_told_apart(self) -> tuple[str, ...]:
        """Joints with an effect whose clearances are not told apart."""
        return tuple(one.joint for one in self.joints if one.most_m is not None and one.clearance_m is None)


@attrs.frozen(kw_only=True)
class PlayMeasurement:
    """Plays of a joint in one or several postures, and the clearances that they come from.

    Attributes
    ----------
    plays : tuple of Play
        The plays, one a recording.
    clearances : Clearances, optional
        Where they come from; null without a mechanism.
    """

    plays: tuple[Play, ...]
    clearances: Clearances | None = None

    @property
    def is_sure(self) -> bool:
        """Whether nothing is doubtful, and all clearances that have an effect are told apart."""
        found = self.clearances
        is_told = found is None or not (found.findings or found.not_told_apart)
        return is_told and not any(play.findings for play in self.plays)

    def to_dict(self) -> dict[str, Any]:
        """Plain object for JSON."""
        plain: dict[str, Any] = {"schema_version": SCHEMA_VERSION, "is_sure": self.is_sure}
        plain["plays"] = [attrs.asdict(play) for play in self.plays]
        plain["clearances"] = None
        if self.clearances is not None:
            told = {"not_told_apart": self.clearances.not_told_apart}
            plain["clearances"] = {**attrs.asdict(self.clearances), **told}
        return plain

    def to_json(self) -> str:
        """Text of `to_dict`: what ``play --json`` writes."""
        return json_text(self.to_dict())
