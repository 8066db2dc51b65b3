"""Parts of what a simulation found; units are in the names, SI throughout."""

import attrs

from leg_wear_monitor.mechanism.arrays import Floats


@attrs.frozen
class TorqueResult:
    """Drive torque [N m] over the counted cycles.

    Attributes
    ----------
    mean, rms, min, max : float
    p99 : float
        99 % of the time the signed torque is below this.
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
    """Where the work went [J].

    Attributes
    ----------
    work_in : float
        Work of the drive and of the loads.
    stored : float
        Change of kinetic and potential energy.
    friction_loss, contact_loss : float
        Loss in the tangential and in the normal direction of the contacts.
    wear_loss : float
        What contacts had stored in walls that wore away: next to nothing at the pace of real wear, a
        thousandth of the losses where clearances double in some thousand cycles.
    residual : float
        What does not add up: an error of integration.
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
    max_velocity_error_mps : float
    max_acceleration_error_mps2 : float
    """

    max_position_error_m: float
    max_velocity_error_mps: float
    max_acceleration_error_mps2: float


@attrs.frozen
class WearDepth:
    """Depth [m] that both surfaces of a joint lose a cycle: deepest sector and mean of all."""

    bushing_max: float
    bushing_mean: float
    journal_max: float
    journal_mean: float


@attrs.frozen
class ClearanceResult:
    """Radial clearance [m] at the end: mean and largest around the bushing."""

    mean: float
    max: float


@attrs.frozen
class JointResult:
    """Forces in a joint and, if it has clearance, its contact and its wear; None without clearance.

    Attributes
    ----------
    mean_force_n, rms_force_n, p99_force_n, max_force_n : float
        Magnitude of the joint force [N]; 99 % of the time it is below ``p99_force_n``.
    contact_fraction : float or None
        Fraction of the time in contact, 0 to 1.
    friction_work_j_per_cycle : float or None
        Work that friction takes [J a cycle].
    archard_integral_j_per_cycle : float or None
        Integral of F_N |v_t| dt [J a cycle]: times a wear coefficient [1/Pa] the worn volume [m³].
    wear_depth_m_per_cycle : WearDepth or None
    wear_zone_deg : tuple of two floats or None
        From, to [deg]: the narrowest zone with 90 % of the bushing's wear, in angles of its own body; None
        without wear.
    clearance_m : ClearanceResult or None
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

    @property
    def has_clearance(self) -> bool:
        """Whether contact and wear are known."""
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
        None for a contact that still lasts.
    peak_n : float
        Largest normal force [N].
    """

    begin_s: float
    speed_mps: float
    end_s: float | None
    peak_n: float


@attrs.frozen(eq=False)
class Trace:
    """Samples at equal times, n of them.

    Attributes
    ----------
    crank_angle_rad : (n,) array
        Counts on over the turns.
    toe_x_m, toe_y_m : (n,) array or None
        None for a mechanism without a point called ``toe``.
    drive_torque_nm : (n,) array
    force_n : dict of str to (n,) array
        Magnitude of the force in each joint [N].
    """

    crank_angle_rad: Floats
    toe_x_m: Floats | None
    toe_y_m: Floats | None
    drive_torque_nm: Floats
    force_n: dict[str, Floats]
