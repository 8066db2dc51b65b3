"""The result of a simulation: its parts in SI units, as JSON and as tables."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import attrs

from leg_wear_monitor.configuration import part_document
from leg_wear_monitor.files import data_frame, json_text
from leg_wear_monitor.mechanism.arrays import Flags, Floats
from leg_wear_monitor.wear import Surfaces

if TYPE_CHECKING:
    import pandas as pd


# Parts of a simulation's result, in SI units.


@attrs.frozen
class TorqueResult:
    """Drive torque [N m] over the evaluated cycles.

    Attributes
    ----------
    mean : float
        Mean over time.
    rms : float
        Root of the mean square over time.
    min : float
        Smallest value, negative where the drive brakes.
    max : float
        Largest value.
    p99 : float
        99th percentile of the signed torque over time.
    max_abs : float
        Largest magnitude.
    max_error : float
        Largest deviation from the ideal linkage at the same crank angle.
    """

    mean: float
    rms: float
    min: float
    max: float
    p99: float
    max_abs: float
    max_error: float


@attrs.frozen
class EnergyBalance:
    """Energy balance over the evaluated cycles [J].

    Attributes
    ----------
    work_in : float
        Work of the drive and of the loads.
    stored : float
        Change of kinetic and potential energy.
    friction_loss : float
        Energy lost in the tangential direction of the contacts.
    contact_loss : float
        Energy lost in the normal direction of the contacts.
    wear_loss : float
        Elastic contact energy lost with removed material: negligible at real wear rates, a thousandth of the
        losses if clearances double within some thousand cycles.
    residual : float
        Work minus stored energy and losses: the integration error.
    """

    work_in: float
    stored: float
    friction_loss: float
    contact_loss: float
    wear_loss: float
    residual: float


@attrs.frozen
class ToeResult:
    """Largest deviations of the toe from the ideal linkage at the same crank angle.

    Attributes
    ----------
    max_position_error_m : float
        Largest error of the position.
    max_velocity_error_mps : float
        Largest error of the velocity.
    max_acceleration_error_mps2 : float
        Largest error of the acceleration.
    """

    max_position_error_m: float
    max_velocity_error_mps: float
    max_acceleration_error_mps2: float


@attrs.frozen
class WearDepth:
    """Wear depth per cycle of both surfaces of a joint [m].

    Attributes
    ----------
    bushing_max : float
        Depth of the deepest sector of the bushing.
    bushing_mean : float
        Mean over all sectors of the bushing.
    journal_max : float
        Depth of the deepest sector of the journal.
    journal_mean : float
        Mean over all sectors of the journal.
    """

    bushing_max: float
    bushing_mean: float
    journal_max: float
    journal_mean: float


@attrs.frozen
class ClearanceResult:
    """Radial clearance [m] at the end.

    Attributes
    ----------
    mean : float
        Mean around the bushing.
    max : float
        Largest around the bushing.
    """

    mean: float
    max: float


@attrs.frozen
class JointResult:
    """Forces in a joint; for a clearance joint also contact and wear, which are None otherwise.

    Attributes
    ----------
    mean_force_n : float
        Mean magnitude of the joint force [N]; without clearance in model ``clearance``, of 1024 samples a
        gait cycle, as its root mean square and its percentile are.
    rms_force_n : float
        Root of its mean square [N].
    p99_force_n : float
        Magnitude that is not exceeded 99 % of the time [N].
    max_force_n : float
        Largest magnitude [N]: one sample of a heavy tail, which does not repeat.
    contact_fraction : float or None
        Fraction of the time in contact, 0 to 1.
    friction_work_j_per_cycle : float or None
        Friction work per cycle [J].
    archard_integral_j_per_cycle : float or None
        Integral of ``F_N |v_t| dt`` per cycle [J]; times a wear coefficient [1/Pa] it is the worn volume
        [m³].
    wear_depth_m_per_cycle : WearDepth or None
        Wear depth of both surfaces.
    wear_zone_deg : tuple of two floats or None
        Narrowest zone (from, to) [deg] with 90 % of the bushing's wear, in the frame of the bushing's body,
        from 0 to 360; ``to`` is below ``from`` if the zone crosses 0. None without wear.
    clearance_m : ClearanceResult or None
        Radial clearance at the end.
    mean_pressure_pa : float or None
        Mean force over the projected area of the bushing, its diameter times its width [Pa].
    p99_pressure_pa : float or None
        Pressure that is not exceeded 99 % of the time [Pa].
    mean_sliding_speed_mps : float or None
        Sliding speed under load: its mean weighted by the force [m/s].
    mean_pressure_speed_pa_mps : float or None
        Mean of pressure times sliding speed [Pa m/s].
    outside_limits : str or None
        Values among ``p99_pressure_pa`` and the two means beyond the joint material's limits, so that
        its wear coefficient is not valid; None within the limits, and without limits.
    holds_for : str or None
        Material pair and regime of the wear coefficient.
    contact_half_angle_deg : float or None
        Half angle of the contact arc under ``p99_force_n`` [deg].
    outside_contact_law : str or None
        Reason why the joint's normal law is not valid for this arc; None if it is.
    """

    mean_force_n: float
    rms_force_n: float
    p99_force_n: float
    max_force_n: float
    contact_fraction: float | None = None
    friction_work_j_per_cycle: float | None = None
    archard_integral_j_per_cycle: float | None = None
    wear_depth_m_per_cycle: WearDepth | None = None
    wear_zone_deg: tuple[float, float] | None = None
    clearance_m: ClearanceResult | None = None
    mean_pressure_pa: float | None = attrs.field(default=None, metadata={"unit": "Pa"})
    p99_pressure_pa: float | None = attrs.field(default=None, metadata={"unit": "Pa"})
    mean_sliding_speed_mps: float | None = None
    mean_pressure_speed_pa_mps: float | None = attrs.field(default=None, metadata={"unit": "Pa m/s"})
    outside_limits: str | None = None
    holds_for: str | None = None
    contact_half_angle_deg: float | None = None
    outside_contact_law: str | None = None

    @property
    def has_clearance(self) -> bool:
        """True if the joint has clearance, and therefore contact and wear."""
        return self.clearance_m is not None


@attrs.frozen
class Impact:
    """One contact between journal and bushing.

    Attributes
    ----------
    begin_s : float
        Time since the start of the simulation [s].
    speed_mps : float
        Approach speed [m/s].
    end_s : float or None
        End of the contact; None for one that lasts beyond the end of the run.
    peak_n : float
        Largest normal force [N].
    """

    begin_s: float
    speed_mps: float
    end_s: float | None
    peak_n: float


@attrs.frozen(eq=False, kw_only=True, repr=False)
class JointTrace:
    """A clearance joint at the n samples of a trace, in the frame of the ground.

    Attributes
    ----------
    eccentricity_m : (n, 2) array
        Centre of the journal in its bushing.
    eccentricity_rate_mps : (n, 2) array
        Rate of the eccentricity.
    penetration_m : (n,) array
        Penetration of journal and bushing; negative where they are apart.
    in_contact : (n,) array of bool
        True if they touch.
    normal_force_n : (n,) array
        Normal force.
    tangential_force_n : (n,) array
        Friction force on the journal, positive in the direction of the normal turned by 90 degrees.
    worn_depth_m : (n,) array
        Wear depth of the deepest sector of the bushing since the start of the simulation.
    """

    eccentricity_m: Floats
    eccentricity_rate_mps: Floats
    penetration_m: Floats
    in_contact: Flags
    normal_force_n: Floats
    tangential_force_n: Floats
    worn_depth_m: Floats


@attrs.frozen(eq=False, kw_only=True, repr=False)
class Trace:
    """n samples at equal time steps; vectors are to the right and upwards.

    Attributes
    ----------
    crank_angle_rad : (n,) array
        Crank angle, continuous over the turns.
    drive_torque_nm : (n,) array
        Torque of the drive on the crank.
    force_n : dict of str to (n,) array
        Magnitude of the force in each joint [N].
    joints : dict of str to JointTrace
        Motion, contact and wear of each clearance joint.
    toe_x_m, toe_y_m : (n,) array or None
        Position of the toe; None for a mechanism without a point called ``toe``.
    toe_velocity_mps, toe_acceleration_mps2 : (n, 2) array or None
        Motion of the toe.
    toe_error_m, toe_error_mps, toe_error_mps2 : (n, 2) array or None
        Deviation of the toe's position, velocity and acceleration from the ideal linkage at the same crank
        angle; None without an ideal motion to compare with.
    """

    crank_angle_rad: Floats
    drive_torque_nm: Floats
    force_n: dict[str, Floats]
    joints: dict[str, JointTrace] = attrs.Factory(dict)
    toe_x_m: Floats | None = None
    toe_y_m: Floats | None = None
    toe_velocity_mps: Floats | None = None
    toe_acceleration_mps2: Floats | None = None
    toe_error_m: Floats | None = None
    toe_error_mps: Floats | None = None
    toe_error_mps2: Floats | None = None

    def __repr__(self) -> str:
        return f"<Trace: {len(self.crank_angle_rad)} samples, joints {', '.join(self.force_n)}>"


# Parts of a simulation's result as JSON objects.


_OF_EVERY_JOINT = ("mean_force_n", "rms_force_n", "p99_force_n", "max_force_n")


def _flat(record: Mapping[str, Any], path: str = "") -> dict[str, Any]:
    """Known values of a JSON object by path: ends of a zone as from and to, vectors as x and y."""
    found: dict[str, Any] = {}
    for key, value in record.items():
        if isinstance(value, dict):
            found |= _flat(value, f"{path}{key}.")
        elif key == "wear_zone_deg" and value is not None:
            found |= {f"{path}{key}.from": value[0], f"{path}{key}.to": value[1]}
        elif isinstance(value, list) and isinstance(value[0], list):
            found |= {f"{path}{key}.{axis}": [pair[k] for pair in value] for k, axis in enumerate("xy")}
        elif value is not None:
            found[f"{path}{key}"] = value
    return found


# The result of a simulation, with its conversion to JSON and to tables.


SCHEMA_VERSION = 1
"""Version of the JSON schema; incremented when a field is renamed, removed or changes its meaning."""


@attrs.frozen(eq=False, repr=False)
class SimulationResult:
    """Result of `simulate` over the evaluated cycles.

    Attributes
    ----------
    mechanism : str
        Name of the mechanism.
    model : str
        Formulation of the motion: ``clearance``, ``full`` or ``ideal``.
    speed_rpm : float
        Mean crank speed, negative for clockwise.
    cycles : float
        Number of evaluated gait cycles.
    simulated_s : float
        Simulated time [s], skipped cycles included.
    drive_torque_nm : TorqueResult
        Torque of the drive on the crank.
    energy_j : EnergyBalance or None
        Energy balance; None for an ideal leg.
    toe : ToeResult or None
        Deviations of the toe; None without a point called ``toe`` or without an ideal motion to compare with.
    joints : dict of str to JointResult
        All joints, ideal ones included.
    impacts : dict of str to tuple of Impact
        The first thousand impacts of each clearance joint.
    trace : Trace or None
        Samples over the evaluated cycles; None if no trace was requested.
    standard_error : dict of str to float, or None
        Standard error of a value by its path, such as ``joints.A.mean_force_n``: the standard deviation
        between gait cycles, divided by the root of their number, as if successive cycles were independent.
        None below two whole cycles, for an ideal leg.
    clearance_joints : tuple of str
        Joints with clearance, in the order of ``surfaces``.
    surfaces : Surfaces or None
        Worn surfaces at the end, in the order of ``clearance_joints``; None for an ideal leg.
    """

    mechanism: str
    model: str
    speed_rpm: float
    cycles: float
    simulated_s: float
    drive_torque_nm: TorqueResult
    energy_j: EnergyBalance | None
    toe: ToeResult | None
    joints: dict[str, JointResult]
    impacts: dict[str, tuple[Impact, ...]] = attrs.Factory(dict)
    trace: Trace | None = None
    standard_error: dict[str, float] | None = None
    clearance_joints: tuple[str, ...] = ()
    surfaces: Surfaces | None = None

    def __repr__(self) -> str:
        joints = ", ".join(self.clearance_joints) or "none"
        return (
            f"<SimulationResult: {self.mechanism}, model {self.model}, {self.speed_rpm:g} rpm, "
            f"{self.cycles:g} gait cycles, clearance joints {joints}>"
        )

    def to_dict(self, wall_s: float | None = None) -> dict[str, Any]:
        """Plain object, as written by ``simulate --json``.

        Parameters
        ----------
        wall_s : float, optional
            Wall-clock duration of the simulation [s]; without it, values that depend on it are left out.
        """
        clock = {} if wall_s is None else {"wall_s": wall_s}
        factor = {} if wall_s is None else {"real_time_factor": self.simulated_s / wall_s}
        record = {
            "schema_version": SCHEMA_VERSION,
            "mechanism": self.mechanism,
            "model": self.model,
            "speed_rpm": self.speed_rpm,
            "cycles": self.cycles,
            **clock,
            "simulated_s": self.simulated_s,
            **factor,
            "drive_torque_nm": part_document(self.drive_torque_nm),
            "energy_j": part_document(self.energy_j),
            "toe": part_document(self.toe),
            "joints": {
                name: {
                    key: value
                    for key, value in attrs.asdict(joint).items()
                    if joint.has_clearance or key in _OF_EVERY_JOINT
                }
                for name, joint in self.joints.items()
            },
            "impacts": {name: [part_document(one) for one in all_] for name, all_ in self.impacts.items()},
            "standard_error": self.standard_error,
        }
        if self.trace is not None:  # a mechanism without a toe lacks some fields
            trace = part_document(self.trace).items()
            record["trace"] = {name: value for name, value in trace if value is not None}
        return record

    def to_json(self, wall_s: float | None = None) -> str:
        """Text of `to_dict`, as written by ``simulate --json``.

        Examples
        --------
        >>> import json
        >>> import leg_wear_monitor as lw
        >>> result = lw.simulate("four_bar", clearances=[], cycles=1)
        >>> json.loads(result.to_json())["model"]
        'ideal'
        """
        return json_text(self.to_dict(wall_s))

    def to_pandas(self) -> "dict[str, pd.DataFrame]":
        """Tables ``joints``, ``impacts`` and, if there is a trace, ``trace``; requires pandas.

        Columns have the names of the fields of the JSON, parts of a field after a dot: ``clearance_m.mean``.

        Raises
        ------
        LegWearError
            If pandas is not installed.
        """
        record = self.to_dict()
        joints = [{"joint": name, **_flat(joint)} for name, joint in record["joints"].items()]
        impacts = [{"joint": name, **one} for name, all_ in record["impacts"].items() for one in all_]
        tables = {"joints": data_frame(joints, index="joint"), "impacts": data_frame(impacts)}
        return tables if self.trace is None else {**tables, "trace": data_frame(_flat(record["trace"]))}
