"""Samples of further encoders, kept until their gait cycle ends."""

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.twin.kinds import CRANK
from leg_wear_monitor.twin.sample import NO_FAULT, Samples

MOST = 20_000  # samples that are kept: ten seconds at 2 kHz


@attrs.frozen(eq=False)
class EncoderSamples:
    """Crank and encoder angles in the order of their arrival, with counts of unusable ones.

    Attributes
    ----------
    stamp_ns : (n,) array of int
    crank_rad : (n,) array
    encoder_rad : (n, m) array
        NaN where absent, infinite where the received value is not an angle.
    samples, absent, no_angle : (m,) arrays of int
        Counts since the start.
    """

    stamp_ns: Ints
    crank_rad: Floats
    encoder_rad: Floats
    samples: Ints
    absent: Ints
    no_angle: Ints


def no_encoder_samples(encoders: int) -> EncoderSamples:
    """Empty samples of a number of encoders."""
    none = np.zeros(encoders, np.int64)
    return EncoderSamples(np.zeros(0, np.int64), np.zeros(0), np.zeros((0, encoders)), none, none, none)


def extended(kept: EncoderSamples, piece: Samples) -> EncoderSamples:
    """Samples extended by the valid crank samples of a piece."""
    piece = piece[(piece["kind"] == CRANK) & (piece["fault"] == NO_FAULT) & (piece["stamp_ns"] > 0)]
    piece = piece[np.isfinite(piece["crank_angle_rad"])]
    if not len(piece):
        return kept
    angles = piece["encoder_rad"][:, : kept.encoder_rad.shape[1]]
    return EncoderSamples(
        np.concatenate([kept.stamp_ns, piece["stamp_ns"]]),
        np.concatenate([kept.crank_rad, piece["crank_angle_rad"]]),
        np.concatenate([kept.encoder_rad, angles]),
        kept.samples + np.isfinite(angles).sum(axis=0),
        kept.absent + np.isnan(angles).sum(axis=0),
        kept.no_angle + np.isinf(angles).sum(axis=0),
    )


def within(kept: EncoderSamples, begin_ns: int, end_ns: int) -> tuple[Ints, Floats, Floats]:
    """Stamps (n,) [ns], crank (n,) and encoder angles (n, m) [rad] between two stamps.

    Of equal stamps the first sample counts.
    """
    _, first = np.unique(kept.stamp_ns, return_index=True)
    first = first[(kept.stamp_ns[first] >= begin_ns) & (kept.stamp_ns[first] < end_ns)]
    return kept.stamp_ns[first], kept.crank_rad[first], kept.encoder_rad[first]


def after(kept: EncoderSamples, stamp_ns: int) -> EncoderSamples:
    """Samples from a stamp on, at most `MOST`."""
    which = np.flatnonzero(kept.stamp_ns >= stamp_ns)[-MOST:]
    return attrs.evolve(
        kept,
        stamp_ns=kept.stamp_ns[which],
        crank_rad=kept.crank_rad[which],
        encoder_rad=kept.encoder_rad[which],
    )
