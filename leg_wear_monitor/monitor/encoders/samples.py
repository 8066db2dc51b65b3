"""Samples of further encoders, kept until their gait cycle ends."""

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.monitor.kept_samples import indices_within, newest, of_crank
from leg_wear_monitor.twin.sample import Samples


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

    def extended(self, piece: Samples) -> "EncoderSamples":
        """With the valid crank samples of a piece."""
        piece = of_crank(piece)
        if not len(piece):
            return self
        angles = piece["encoder_rad"][:, : self.encoder_rad.shape[1]]
        return EncoderSamples(
            np.concatenate([self.stamp_ns, piece["stamp_ns"]]),
            np.concatenate([self.crank_rad, piece["crank_angle_rad"]]),
            np.concatenate([self.encoder_rad, angles]),
            self.samples + np.isfinite(angles).sum(axis=0),
            self.absent + np.isnan(angles).sum(axis=0),
            self.no_angle + np.isinf(angles).sum(axis=0),
        )

    def after(self, stamp_ns: int) -> "EncoderSamples":
        """Those from a stamp on."""
        which = newest(self.stamp_ns, stamp_ns)
        return attrs.evolve(
            self,
            stamp_ns=self.stamp_ns[which],
            crank_rad=self.crank_rad[which],
            encoder_rad=self.encoder_rad[which],
        )


def no_encoder_samples(encoders: int) -> EncoderSamples:
    """Empty samples of a number of encoders."""
    none = np.zeros(encoders, np.int64)
    return EncoderSamples(np.zeros(0, np.int64), np.zeros(0), np.zeros((0, encoders)), none, none, none)


def within(kept: EncoderSamples, begin_ns: int, end_ns: int) -> tuple[Ints, Floats, Floats]:
    """Stamps (n,) [ns], crank (n,) and encoder angles (n, m) [rad] between two stamps."""
    which = indices_within(kept.stamp_ns, begin_ns, end_ns)
    return kept.stamp_ns[which], kept.crank_rad[which], kept.encoder_rad[which]
