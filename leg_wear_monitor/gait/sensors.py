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
    JointEncodersConfig,
    TorqueSensorConfig,
    TransportConfig,
)
from leg_wear_monitor.gait.leg import SyntheticLeg
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.twin import CRANK, LOAD, TORQUE
from leg_wear_monitor.twin.sample import FAULTS, NO_FAULT, OUT_OF_RANGE, WRONG_TYPE

_CONTACT_N = 20.0  # force from which a switch closes

# faults that can be injected into messages
_MADE = tuple(fault for fault in FAULTS if fault not in (NO_FAULT, WRONG_TYPE, OUT_OF_RANGE))


class Reading(NamedTuple):
    """A sensor message: times of arrival and of measurement [s since the start], and its content."""

    arrival_s: float
    taken_s: float
    kind: int
    fault: int
    crank_angle_rad: float
    crank_velocity_radps: float
    torque_nm: float
    encoder_rad: tuple[float, ...] = ()
    foot_force_n: tuple[float, float] = (math.nan, math.nan)


class Noise:
    """Sequences of normal and uniform random numbers; drawn in blocks, which is ten times as fast."""

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
    return _arriving(_taken(leg, config), config.transport, Noise([config.seed, 3]))


def stamp_ns(reading: Reading, start_ns: int) -> int:
    """Stamp of a reading [ns]."""
    return start_ns + round(reading.taken_s * 1.0e9)


def _taken(leg: SyntheticLeg, config: GaitConfig) -> Iterator[Reading]:
    """Readings in order of measurement."""
    jitter = config.transport.jitter_s
    encoder, torque = Noise([config.seed, 1]), Noise([config.seed, 2])
    further = Noise([config.seed, 4])
    turned: tuple[float, ...] = ()
    by_effort = config.torque_sensor.source == EFFORT
    crank_times = _times(config.encoder.rate_hz, jitter, encoder, CRANK)
    torque_times = iter(()) if by_effort else _times(config.torque_sensor.rate_hz, jitter, torque, TORQUE)
    of_load = config.foot_load_sensor
    load, stuck = Noise([config.seed, 5]), (0.0, 0.0)
    load_times = iter(()) if of_load.source == NO_LOAD else _times(of_load.rate_hz, jitter, load, LOAD)
    since, impulse, zero_rad, restarts = 0.0, 0.0, 0.0, list(config.encoder.restarts_s)
    for t, kind in heapq.merge(crank_times, torque_times, load_times):
        if config.duration_s and t >= config.duration_s:
            return
        instant = leg.advance(t)
        if kind == LOAD:
            if not of_load.stuck_from_s or t < of_load.stuck_from_s:
                stuck = _foot_load(of_load, leg, instant.crank.angle, t, load)
            if not of_load.silent_from_s or t < of_load.silent_from_s:
                yield Reading(t, t, kind, NO_FAULT, math.nan, math.nan, math.nan, (), stuck)
            continue
        angle, velocity, torque_nm = math.nan, math.nan, math.nan
        if kind == CRANK:
            while restarts and t >= restarts[0]:
                zero_rad = instant.crank.angle
                restarts.pop(0)
            angle, velocity = _encoder(config.encoder, instant.crank, zero_rad, encoder)
            turned = _further(config.joint_encoders, instant.encoder_rad, further)
        if kind == TORQUE or by_effort:
            mean = (instant.torque_impulse - impulse) / (t - since)
            since, impulse = t, instant.torque_impulse
            at_once = config.torque_sensor.sampling == INSTANT
            torque_nm = _torque(config.torque_sensor, instant.torque_nm if at_once else mean, torque)
        yield Reading(t, t, kind, NO_FAULT, angle, velocity, torque_nm, turned if kind == CRANK else ())


def _times(rate_hz: float, jitter_s: float, noise: Noise, kind: int) -> Iterator[tuple[float, int]]:
    """Measurement times of a sensor [s]: equal intervals with jitter, which never swaps two readings."""
    most = 0.45 / rate_hz
    for i in itertools.count(1):
        yield i / rate_hz + min(most, max(-most, jitter_s * noise.normal())), kind


def _encoder(config: EncoderConfig, crank: CrankMotion, zero_rad: float, noise: Noise) -> tuple[float, float]:
    angle = crank.angle - zero_rad + config.offset_rad + config.noise_rad * noise.normal()
    velocity = crank.speed + config.velocity_noise_radps * noise.normal()
    if config.counts_per_turn:
        step = TURN / config.counts_per_turn
        angle = round(angle / step) * step
    return angle % TURN if config.wrapped else angle, velocity


def _further(config: JointEncodersConfig, angles: tuple[float, ...], noise: Noise) -> tuple[float, ...]:
    none = (0.0,) * len(angles)
    errors = zip(angles, config.offsets_rad or none, config.scale_errors or none, strict=True)
    return tuple(
        angle * (1.0 + scale) + offset + config.noise_rad * noise.normal() for angle, offset, scale in errors
    )


def _torque(config: TorqueSensorConfig, torque_nm: float, noise: Noise) -> float:
    reading = torque_nm + config.offset_nm + config.noise_nm * noise.normal()
    if config.resolution_nm:
        reading = round(reading / config.resolution_nm) * config.resolution_nm
    return reading


def _foot_load(
    config: FootLoadSensorConfig, leg: SyntheticLeg, angle: float, t: float, noise: Noise
) -> tuple[float, float]:
    x, y = leg.foot_force_n(angle + (math.pi if config.is_swapped else 0.0))
    if config.source == CONTACT:
        return 0.0, float(y > _CONTACT_N)
    x, y = x + config.noise_n * noise.normal(), y + config.noise_n * noise.normal()
    y += config.zero_n + config.zero_drift_n_per_s * t
    return config.scale * x if config.source == WRENCH else 0.0, config.scale * y


def _arriving(taken: Iterable[Reading], config: TransportConfig, noise: Noise) -> Iterator[Reading]:
    """Readings that arrive, in order of arrival."""
    order = itertools.count()
    faults = itertools.cycle(_MADE)
    under_way: list[tuple[float, int, Reading]] = []
    for reading in taken:
        while under_way and under_way[0][0] <= reading.taken_s:
            yield heapq.heappop(under_way)[2]
        chance = [noise.uniform() for _ in range(4)]
        if chance[0] < config.drop_fraction or _in_gap(reading.taken_s, config):
            continue
        late = config.late_s if chance[1] < config.late_fraction else 0.0
        fault = next(faults) if chance[2] < config.fault_fraction else reading.fault
        sent = reading._replace(arrival_s=reading.taken_s + late, fault=fault)
        for _ in range(2 if chance[3] < config.duplicate_fraction else 1):
            heapq.heappush(under_way, (sent.arrival_s, next(order), sent))
    while under_way:
        yield heapq.heappop(under_way)[2]


def _in_gap(t: float, config: TransportConfig) -> bool:
    return any(start <= t < start + config.gap_s for start in config.gaps_s)
