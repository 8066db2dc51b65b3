"""Parts of a simulation's result, in SI units."""

import attrs

from leg_wear_monitor.mechanism.arrays import Floats


@attrs.frozen
class TorqueResult:
    """Drive torque [N m] over the counted cycles.

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
    """Energy balance over the counted cycles [J].

    Attributes
    ----------
    work_in : float
        Work of the drive and of the loads.
    stored : float
        Change of kinetic and potential energy.
    friction_loss : float
        Energy lost in the tangential direction of the contacts.
    contact_loss : float
        Energy lost in the normal direction of the contacts, and in films of oil or grease.
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
        Of the position.
    max_velocity_error_mps : float
        Of the velocity.
    max_acceleration_error_mps2 : float
        Of the acceleration.
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
        Of the deepest sector of the bushing.
    bushing_mean : float
        Mean over all sectors of the bushing.
    journal_max : float
        Of the deepest sector of the journal.
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
        Mean magnitude of the joint force [N].
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
        Of both surfaces.
    wear_zone_deg : tuple of two floats or None
        Narrowest zone (from, to) [deg] with 90 % of the bushing's wear, in the frame of the bushing's body;
        None without wear.
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
        What of ``p99_pressure_pa`` and the two means is beyond the limits of the joint's material, so that
        its wear coefficient does not hold; None within the limits, and without limits.
    holds_for : str or None
        Material pair and regime that the wear holds for.
    contact_half_angle_deg : float or None
        Half angle of the contact arc under ``p99_force_n`` [deg].
    outside_contact_law : str or None
        Why the joint's normal law does not hold for this arc; None if it does.
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
        """Whether the joint has clearance, and therefore contact and wear."""
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


@attrs.frozen(eq=False)
class Trace:
    """n samples at equal time steps.

    Attributes
    ----------
    crank_angle_rad : (n,) array
        Crank angle, continuous over the turns.
    toe_x_m : (n,) array or None
        Toe, to the right; None for a mechanism without a point called ``toe``.
    toe_y_m : (n,) array or None
        Toe, upwards.
    drive_torque_nm : (n,) array
        Torque of the drive on the crank.
    force_n : dict of str to (n,) array
        Magnitude of the force in each joint [N].
    """

    crank_angle_rad: Floats
    toe_x_m: Floats | None
    toe_y_m: Floats | None
    drive_torque_nm: Floats
    force_n: dict[str, Floats]
