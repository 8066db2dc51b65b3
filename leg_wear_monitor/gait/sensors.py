"""Sensor readings of the synthetic leg, and their transport (delay, loss, faults)."""

import heapq
import itertools
import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.dynamics.run import CrankMotion
from leg_wear_monitor.gait.config import (
    CONTACT,
    EFFORT,
    INSTANT,
    NO_LOAD,
    WRENCH,
    EncoderConfig,
    FootLoadSensorConfig,
    GaitConfig,
    TorqueSensorConfig,
    TransportConfig,
)
from leg_wear_monitor.gait.leg import SyntheticLeg
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.twin import CRANK, LOAD, TORQUE
from leg_wear_monitor.twin.sample import FAULTS, NO_FAULT, OUT_OF_RANGE, WRONG_TYPE

_SWITCH_N = 20.0  # vertical force above which a contact switch reads 1

# Each sensor and the transport has its own random stream, selected by this number together with the seed. A
# changed setting of one sensor therefore leaves the noise of the other sensors unchanged.
_CRANK_NOISE, _TORQUE_NOISE, _TRANSPORT_NOISE, _LOAD_NOISE = 1, 2, 3, 5

# Faults that a message can have on the wire. The tracker finds OUT_OF_RANGE in the values, and a message of
# the wrong type never reaches the topic.
_INJECTED_FAULTS = tuple(fault for fault in FAULTS if fault not in (NO_FAULT, WRONG_TYPE, OUT_OF_RANGE))


class Reading(NamedTuple):
    """A sensor message: times of arrival and of measurement [s since the start], and its content.

    ``kind`` is CRANK, TORQUE or LOAD; values of other kinds of sensors are NaN or empty. A
    reading with a ``fault`` (a key of `FAULTS`) is sent as a message with this fault.
    """

    arrival_s: float
    taken_s: float
    kind: int
    fault: int
    crank_angle_rad: float
    crank_velocity_radps: float
    torque_nm: float
    foot_force_n: tuple[float, float] = (math.nan, math.nan)


class Noise:
    """Normal and uniform random numbers one by one, drawn in blocks because that is ten times as fast."""

    def __init__(self, seed: list[int]) -> None:
        self._rng = np.random.default_rng(seed)
        self._normal: Iterator[float] = iter(())
        self._uniform: Iterator[float] = iter(())

    def normal(self) -> float:
        """Next normally distributed number, with standard deviation 1."""
        for value in self._normal:
            return value
        self._normal = iter(self._rng.standard_normal(1024).tolist())
        return next(self._normal)

    def uniform(self) -> float:
        """Next uniformly distributed number in [0, 1)."""
        for value in self._uniform:
            return value
        self._uniform = iter(self._rng.random(1024).tolist())
        return next(self._uniform)


def readings(leg: SyntheticLeg, config: GaitConfig) -> Iterator[Reading]:
    """Readings of the leg in order of arrival; endless unless the configuration sets a duration."""
    return _transported(_measured(leg, config), config.transport, Noise([config.seed, _TRANSPORT_NOISE]))


def stamp_ns(reading: Reading, start_ns: int) -> int:
    """Stamp of a reading [ns]: its time of measurement."""
    return start_ns + round(reading.taken_s * 1.0e9)


def _measured(leg: SyntheticLeg, config: GaitConfig) -> Iterator[Reading]:
    """Readings in order of measurement; the leg advances to the time of each."""
    jitter_s, torque_config, load_config = (
        config.transport.jitter_s,
        config.torque_sensor,
        config.foot_load_sensor,
    )
    crank_noise, torque_noise, load_noise = (
        Noise([config.seed, stream]) for stream in (_CRANK_NOISE, _TORQUE_NOISE, _LOAD_NOISE)
    )
    is_torque_with_crank = torque_config.source == EFFORT  # both are in one JointState
    crank_times = _times(config.encoder.rate_hz, jitter_s, crank_noise, CRANK)
    torque_times: Iterator[tuple[float, int]] = iter(())
    if not is_torque_with_crank:
        torque_times = _times(torque_config.rate_hz, jitter_s, torque_noise, TORQUE)
    load_times: Iterator[tuple[float, int]] = iter(())
    if load_config.source != NO_LOAD:
        load_times = _times(load_config.rate_hz, jitter_s, load_noise, LOAD)
    last_torque_s, last_impulse = 0.0, 0.0  # for the mean torque since the last torque reading
    for t, kind in heapq.merge(crank_times, torque_times, load_times):
        if config.duration_s and t >= config.duration_s:
            return
        instant = leg.advance(t)
        if kind == LOAD:
            foot_force_n = _foot_load(load_config, leg, instant.crank.angle, load_noise)
            if not load_config.silent_from_s or t < load_config.silent_from_s:
                yield Reading(t, t, kind, NO_FAULT, math.nan, math.nan, math.nan, foot_force_n)
            continue
        angle, velocity, torque_nm = math.nan, math.nan, math.nan
        if kind == CRANK:
            angle, velocity = _encoder(config.encoder, instant.crank, crank_noise)
        if kind == TORQUE or is_torque_with_crank:
            mean_nm = (instant.torque_impulse - last_impulse) / (t - last_torque_s)
            last_torque_s, last_impulse = t, instant.torque_impulse
            is_instant = torque_config.sampling == INSTANT
            torque_nm = _torque(torque_config, instant.torque_nm if is_instant else mean_nm, torque_noise)
        yield Reading(t, t, kind, NO_FAULT, angle, velocity, torque_nm)


def _times(rate_hz: float, jitter_s: float, noise: Noise, kind: int) -> Iterator[tuple[float, int]]:
    """Measurement times of a sensor [s]: equal intervals with jitter, which never swaps two readings."""
    most = 0.45 / rate_hz  # below half an interval, so that neighbours keep their order
    for i in itertools.count(1):
        yield i / rate_hz + min(most, max(-most, jitter_s * noise.normal())), kind


def _encoder(config: EncoderConfig, crank: CrankMotion, noise: Noise) -> tuple[float, float]:
    """Crank angle [rad] and velocity [rad/s] as measured."""
    angle = crank.angle + config.offset_rad + config.noise_rad * noise.normal()
    velocity = crank.speed + config.velocity_noise_radps * noise.normal()
    if config.counts_per_turn:
        step = TURN / config.counts_per_turn
        angle = round(angle / step) * step
    return angle % TURN if config.wrapped else angle, velocity


def _torque(config: TorqueSensorConfig, torque_nm: float, noise: Noise) -> float:
    """Drive torque as measured [N m]."""
    reading = torque_nm + config.noise_nm * noise.normal()
    if config.resolution_nm:
        reading = round(reading / config.resolution_nm) * config.resolution_nm
    return reading


def _foot_load(
    config: FootLoadSensorConfig, leg: SyntheticLeg, angle: float, noise: Noise
) -> tuple[float, float]:
    """Horizontal and vertical foot force as measured [N]; of a contact switch, 0 and whether it is closed."""
    x, y = leg.foot_force_n(angle)
    if config.source == CONTACT:
        return 0.0, float(y > _SWITCH_N)
    x, y = x + config.noise_n * noise.normal(), y + config.noise_n * noise.normal()
    return x if config.source == WRENCH else 0.0, y


def _transported(measured: Iterable[Reading], config: TransportConfig, noise: Noise) -> Iterator[Reading]:
    """Readings that arrive, in order of arrival: some are dropped, late, faulty or duplicated."""
    sequence = itertools.count()  # orders readings that arrive at the same time
    faults = itertools.cycle(_INJECTED_FAULTS)
    in_transit: list[tuple[float, int, Reading]] = []
    for reading in measured:
        while in_transit and in_transit[0][0] <= reading.taken_s:
            yield heapq.heappop(in_transit)[2]
        # We always draw four numbers per reading, so that one setting does not change the effects of the
        # other settings.
        chance = [noise.uniform() for _ in range(4)]
        if chance[0] < config.drop_fraction or _in_gap(reading.taken_s, config):
            continue
        delay_s = config.late_s if chance[1] < config.late_fraction else 0.0
        fault = next(faults) if chance[2] < config.fault_fraction else reading.fault
        sent = reading._replace(arrival_s=reading.taken_s + delay_s, fault=fault)
        for _ in range(2 if chance[3] < config.duplicate_fraction else 1):
            heapq.heappush(in_transit, (sent.arrival_s, next(sequence), sent))
    while in_transit:
        yield heapq.heappop(in_transit)[2]


def _in_gap(t: float, config: TransportConfig) -> bool:
    return any(start <= t < start + config.gap_s for start in config.gaps_s)
