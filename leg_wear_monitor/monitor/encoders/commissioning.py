"""The encoders' own errors: unknown at first, estimated while the clearances are known, then fixed."""

from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.config.inputs import Encoders
from leg_wear_monitor.monitor.encoders.angle_regression import Estimate
from leg_wear_monitor.monitor.ledger.entry import Commissioned

_OFFSET_SIGMA_RAD = 0.05  # standard deviation of an encoder's offset before commissioning
_SCALE_SIGMA = 0.01


@attrs.frozen(eq=False)
class EncoderErrors:
    """Estimated errors of m encoders.

    Attributes
    ----------
    centre_rad : (m,) array
        Zero of an encoder's deviation, NaN before the first gait cycle: the zero of an encoder is arbitrary.
    mean : (1 + 2 m,) array
        Offset of the crank's encoder, offsets from the centres [rad] and scale errors of the others.
    covariance : array
    known : tuple of bool
        Which encoders were commissioned.
    """

    centre_rad: Floats
    mean: Floats
    covariance: Floats
    known: tuple[bool, ...]


def names_of(encoders: Encoders) -> tuple[str, ...]:
    """Identification of each encoder: name, joint and sign."""
    signs = encoders.signs or (1.0,) * len(encoders.names)
    return tuple(
        f"{name} on {joint} {sign:+.0f}"
        for name, joint, sign in zip(encoders.names, encoders.joints, signs, strict=True)
    )


def errors_of(encoders: Encoders, held: Commissioned | None) -> EncoderErrors:
    """Stored errors of commissioned encoders; the errors of the others are unknown."""
    names = names_of(encoders)
    m = len(names)
    centre, mean = np.full(m, np.nan), np.zeros(1 + 2 * m)
    sigma = np.concatenate([np.full(1 + m, _OFFSET_SIGMA_RAD), np.full(m, _SCALE_SIGMA)])
    covariance = np.diag(np.square(sigma))
    if held is None:
        return EncoderErrors(centre, mean, covariance, (False,) * m)
    common = [(i, held.encoders.index(name)) for i, name in enumerate(names) if name in held.encoders]
    here, there = [i for i, _ in common], [j for _, j in common]
    own, kept = _rows(here, m), _rows(there, len(held.encoders))
    centre[here], mean[own] = held.centre_rad[there], held.mean[kept]
    covariance[np.ix_(own, own)] = held.covariance[np.ix_(kept, kept)]
    return EncoderErrors(centre, mean, covariance, tuple(name in held.encoders for name in names))


def _rows(which: Sequence[int], m: int) -> list[int]:
    """Rows of the crank's offset, and of the offsets and scale errors of some encoders."""
    return [0, *(1 + i for i in which), *(1 + m + i for i in which)]


def held(errors: EncoderErrors, encoders: Encoders, stamp_ns: int) -> Commissioned:
    """Errors of the commissioned encoders, as stored in the ledger."""
    which = [i for i, known in enumerate(errors.known) if known]
    rows = _rows(which, len(errors.known))
    return Commissioned(
        stamp_ns,
        tuple(names_of(encoders)[i] for i in which),
        errors.centre_rad[which],
        errors.mean[rows],
        errors.covariance[np.ix_(rows, rows)],
    )


def known_with(errors: EncoderErrors, clearance_m: Floats, sigma_m: Floats | float) -> Estimate:
    """Estimate of the encoders' errors and of clearances (k,) with the given standard deviation."""
    k, p = len(clearance_m), len(errors.mean)
    covariance = np.zeros((k + p, k + p))
    covariance[:k, :k] = np.diag(np.square(np.broadcast_to(sigma_m, k)))
    covariance[k:, k:] = errors.covariance
    return Estimate(np.concatenate([clearance_m, errors.mean]), covariance, k)


def commissioned(errors: EncoderErrors, found: Estimate, present: Sequence[bool]) -> EncoderErrors:
    """Errors fixed at the given estimate."""
    k = found.joints
    known = tuple(was or is_ for was, is_ in zip(errors.known, present, strict=True))
    return EncoderErrors(errors.centre_rad, found.mean[k:], found.covariance[k:, k:], known)
