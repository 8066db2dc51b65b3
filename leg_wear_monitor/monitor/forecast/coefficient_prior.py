"""Prior of each joint's wear coefficient: the spread of its material pair, or what a fleet has learned.

A file of priors belongs to one leg. For each joint it has the prior of the present part, from the measured
clearances of all other parts, and the prior of the next part, whose lot is not known yet. Wear coefficients
are absolute, so the file stays right if the nominal coefficient of the leg changes.
"""

import json
import math
from collections.abc import Mapping
from pathlib import Path

import attrs

from leg_wear_monitor.configuration.quantity import described, quantity
from leg_wear_monitor.configuration.strict import structure
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.clearance import Clearance
from leg_wear_monitor.mechanism.materials.of_joints import regime_of, spread_of
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.forecast import Forecasting

SCHEMA_VERSION = 1

USUAL_SPREAD = 0.7
"""Logarithmic standard deviation of a wear coefficient whose pair gives none.

A factor of two up or down: reported wear rates scatter by that much and more (Schmitz and others, Journal of
Tribology 126 (2004) 802). It is a judgement, not a measurement.
"""


@attrs.frozen(kw_only=True)
class CoefficientPrior:
    """Normal prior of the logarithm of a joint's factor on its nominal wear coefficient.

    Attributes
    ----------
    mean : float
        Mean of the logarithm of the factor.
    sigma : float
        Standard deviation of this logarithm.
    basis : str
        What it rests on, such as ``19 parts of lot 2026-03`` or ``spread of steel-on-steel-greased-mild``.
    holds_for : str
        Material pair and regime that the wear coefficient holds for.
    """

    mean: float = 0.0
    sigma: float
    basis: str = ""
    holds_for: str = ""


@attrs.frozen(kw_only=True)
class LearnedCoefficient:
    """Lognormal distribution of a part's wear coefficient, as in a file of priors."""

    wear_coefficient_per_pa: float = quantity(
        "1/Pa", "median of the wear coefficients of bushing and journal together", above=0.0
    )
    sigma: float = quantity("", "standard deviation of its logarithm", at_least=1.0e-6, at_most=10.0)
    basis: str = described("what was measured for it")


@attrs.frozen(kw_only=True)
class LearnedJoint:
    """Priors of a joint's present and next part, as in a file of priors."""

    replaced_ns: int = quantity("ns", "when the present part was mounted, 0 for the first", at_least=0)
    present: LearnedCoefficient = described("of the present part, without its own measurements")
    next: LearnedCoefficient = described("of a part of a new lot")


@attrs.frozen(kw_only=True)
class LearnedPriors:
    """Content of a file of priors."""

    schema_version: int = described("version of the file's fields")
    leg: str = described("leg of the fleet")
    joints: dict[str, LearnedJoint] = described("priors by joint; a joint without one has that of its pair")


@attrs.frozen
class PriorSource:
    """Where the forecast takes the prior of a part from.

    Attributes
    ----------
    usual : dict of str to CoefficientPrior
        Prior of each joint that nothing was learned of.
    learned : dict of str to LearnedJoint
        Joints of the file of priors.
    nominal_per_pa : dict of str to float
        Nominal wear coefficients of bushing and journal together.
    """

    usual: Mapping[str, CoefficientPrior]
    learned: Mapping[str, LearnedJoint]
    nominal_per_pa: Mapping[str, float]

    def prior(self, joint: str, replaced_ns: int) -> CoefficientPrior:
        """Prior of the part that a joint has had since a stamp, 0 for its first part."""
        learned, nominal = self.learned.get(joint), self.nominal_per_pa.get(joint, 0.0)
        if learned is None or not nominal > 0.0:
            return self.usual[joint]
        found = learned.present if learned.replaced_ns == replaced_ns else learned.next
        return attrs.evolve(
            self.usual[joint],
            mean=math.log(found.wear_coefficient_per_pa / nominal),
            sigma=found.sigma,
            basis=found.basis,
        )


def nominal_per_pa(clearance: Clearance) -> float:
    """Nominal wear coefficient of bushing and journal together [1/Pa]."""
    return sum(clearance.wear_coefficient)


def prior_source(mechanism: Mechanism, settings: Forecasting) -> PriorSource:
    """Priors of a leg, from the file that ``forecast.priors`` names if it names one.

    Parameters
    ----------
    mechanism : Mechanism
        As the configuration wants it.
    settings : Forecasting

    Raises
    ------
    ConfigError
        For a file that cannot be used.
    """
    learned = read_priors(settings.priors).joints if settings.priors else {}
    nominal = {name: nominal_per_pa(clearance) for name, clearance in mechanism.clearances.items()}
    usual = {name: usual_prior(settings, clearance) for name, clearance in mechanism.clearances.items()}
    return PriorSource(usual, learned, nominal)


def usual_prior(settings: Forecasting, clearance: Clearance | None = None) -> CoefficientPrior:
    """Prior of a joint that nothing was learned of (docs/decisions/0012-wear-prior.md).

    Parameters
    ----------
    settings : Forecasting
        A configured spread comes first.
    clearance : Clearance, optional
        Settings of the joint, whose material pair may give a spread; `USUAL_SPREAD` if it does not.
    """
    regime = regime_of(clearance) if clearance else ""
    if settings.wear_coefficient_sigma > 0.0:
        basis = "forecast.wear_coefficient_sigma"
        return CoefficientPrior(sigma=settings.wear_coefficient_sigma, basis=basis, holds_for=regime)
    of_pair = spread_of(clearance, USUAL_SPREAD) if clearance else None
    if clearance is None or of_pair is None:
        basis = "usual scatter of wear coefficients"
        return CoefficientPrior(sigma=USUAL_SPREAD, basis=basis, holds_for=regime)
    return CoefficientPrior(sigma=of_pair, basis=f"spread of {clearance.material}", holds_for=regime)


def read_priors(path: str) -> LearnedPriors:
    """Content of a file of priors.

    Raises
    ------
    ConfigError
        If it cannot be read.
    """
    try:
        document = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(path, "", f"cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise ConfigError(path, "", f"is not JSON: {' '.join(str(error).split())}") from error
    priors: LearnedPriors = structure(document, LearnedPriors, path, "")
    if priors.schema_version != SCHEMA_VERSION:
        fault = f"{priors.schema_version} is not {SCHEMA_VERSION}, the version that this program reads"
        raise ConfigError(path, "schema_version", f"{fault}; update the fleet again")
    return priors
