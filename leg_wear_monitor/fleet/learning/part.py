"""Parts of the legs of a fleet, with what their measured clearances say about their wear coefficients."""

from collections.abc import Mapping, Sequence

import attrs

from leg_wear_monitor.mechanism.clearance import Clearance
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.forecast import Forecasting
from leg_wear_monitor.monitor.forecast.coefficient_prior import (
    CoefficientPrior,
    nominal_per_pa,
    usual_prior,
)
from leg_wear_monitor.monitor.forecast.known_clearance import corrections_of
from leg_wear_monitor.monitor.forecast.measurement import observations_of
from leg_wear_monitor.monitor.forecast.wear_coefficients import measured_factor
from leg_wear_monitor.monitor.ledger.entry import CorrectedClearance, Measurement


@attrs.frozen(kw_only=True)
class Part:
    """A part of a leg: journal and bushing of a joint, until they are replaced.

    Attributes
    ----------
    leg, joint : str
    replaced_ns : int
        When it was mounted, 0 for the first part.
    is_present : bool
        Whether it is in the leg now.
    pair : str
        Material pair and nominal wear coefficients.
    lot : str
        Empty if it is not known.
    nominal_per_pa : float
        Nominal wear coefficient of bushing and journal together.
    prior : CoefficientPrior
        That of its material pair, before anything is learned.
    factor, precision : float
        Factor on the nominal coefficient by the measured clearances, and the inverse of its variance; a
        precision of 0 means that nothing is measured.
    """

    leg: str
    joint: str
    replaced_ns: int = 0
    is_present: bool = True
    pair: str
    lot: str = ""
    nominal_per_pa: float
    prior: CoefficientPrior
    factor: float = 0.0
    precision: float = 0.0

    @property
    def key(self) -> tuple[str, str, int]:
        """Leg, joint and time of mounting, which name a part."""
        return self.leg, self.joint, self.replaced_ns


def parts_of(
    leg: str,
    mechanism: Mechanism,
    settings: Forecasting,
    measurements: Sequence[Measurement],
    replaced_ns: Mapping[str, int],
    *,
    lot: str = "",
    lots: Mapping[str, str] | None = None,
    corrections: Sequence[CorrectedClearance] = (),
) -> list[Part]:
    """All parts that a leg has, and those it had that were measured.

    Parameters
    ----------
    leg : str
        Its name in the fleet.
    mechanism : Mechanism
        As the configuration wants it.
    settings : Forecasting
    measurements : sequence of Measurement
        Of its ledger.
    replaced_ns : mapping of str to int
        When the present part of each joint was mounted; 0 for the first part, and for an absent joint.
    lot : str, optional
        Lot of the parts that the leg was built with.
    lots : mapping of str to str, optional
        Lots of the present parts of single joints; a replaced part has no other known lot.
    corrections : sequence of CorrectedClearance
        Of its ledger.
    """
    parts = []
    for joint in mechanism.clearance_joints:
        clearance, present = mechanism.clearances[joint], replaced_ns.get(joint, 0)
        mounted = {m.replaced_ns for m in measurements if m.joint == joint} | {present}
        for when in sorted(mounted):
            observations = observations_of(measurements, joint, when)
            corrected = corrections_of(corrections, joint, when)
            factor, precision = measured_factor(settings, clearance.radial_clearance, observations, corrected)
            own = (lots or {}).get(joint, "") if when == present else ""
            parts.append(
                Part(
                    leg=leg,
                    joint=joint,
                    replaced_ns=when,
                    is_present=when == present,
                    pair=pair_of(clearance),
                    lot=own or (lot if when == 0 else ""),
                    nominal_per_pa=nominal_per_pa(clearance),
                    prior=usual_prior(settings, clearance),
                    factor=factor,
                    precision=precision,
                )
            )
    return [part for part in parts if part.nominal_per_pa > 0.0]


def pair_of(clearance: Clearance) -> str:
    """Name of a material pair: parts with the same name have the same nominal wear coefficients."""
    bushing, journal = clearance.wear_coefficient
    return f"{clearance.material or 'no material'}, {bushing:.6g} and {journal:.6g} 1/Pa"
