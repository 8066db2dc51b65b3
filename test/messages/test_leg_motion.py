"""Frames of the moving leg: the same however samples are cut, and what is no frame is refused."""

import json

import attrs
import numpy as np
import pytest

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.messages.leg_motion import PERIOD_NS, PHASES, LegMotion, received_frame, whole_cycles
from leg_wear_monitor.twin.statistics import SampleStatistics

MS = 1_000_000
RATE_HZ = 1000


def walked(seconds=2.5, turns_per_s=1.0, lost=()):
    """A crank that turns evenly; joint A is in contact but for a tenth of a turn, joint B always."""
    n = round(seconds * RATE_HZ)
    stamp_ns = 10**15 + np.arange(n, dtype=np.int64) * MS
    turn = turns_per_s * np.arange(n) / RATE_HZ
    angle = turn % 1.0 * 2.0 * np.pi
    free = (turn % 1.0) < 0.1
    force = np.stack([np.where(free, 0.0, 50.0 + 100.0 * (turn % 1.0)), np.full(n, 20.0)], axis=1)
    place = np.stack([np.stack([np.cos(angle), np.sin(angle)], axis=1) * 3.0e-4] * 2, axis=1)
    for begin, end in lost:
        angle[begin:end] = np.nan
    return SampleStatistics(
        stamp_ns=stamp_ns,
        kind=np.zeros(n, np.int64),
        crank_angle_rad=angle,
        predicted_torque_nm=np.sin(angle),
        contact_force_n=force,
        measured_torque_nm=2.0 * np.sin(angle),
        eccentricity_m=place,
    )


def cut(samples, ends):
    """The samples in pieces."""
    columns = attrs.asdict(samples, recurse=False)
    for begin, end in zip([0, *ends], [*ends, len(samples)], strict=True):
        yield SampleStatistics(**{name: column[begin:end] for name, column in columns.items()})


def frames(*pieces):
    motion = LegMotion(["A", "B"])
    return [frame for piece in pieces for frame in motion.of(piece)]


def test_there_are_twenty_frames_a_second_with_angle_place_and_force():
    found = frames(walked())
    assert len(found) == 50
    assert {frame.stamp_ns % PERIOD_NS for frame in found} == {0}
    tenth = found[10]
    assert tenth.crank_angle_rad == pytest.approx(np.pi, abs=1e-3)
    assert tenth.joints["A"].eccentricity_m == pytest.approx((-3.0e-4, 0.0), abs=1e-8)
    assert tenth.joints["A"].force_n == pytest.approx(100.0)


@pytest.mark.parametrize("turns_per_s", [1.0, -1.3])
def test_frames_do_not_depend_on_how_samples_are_cut(turns_per_s):
    samples = walked(turns_per_s=turns_per_s)
    ends = sorted({int(end) for end in np.random.default_rng(1).integers(1, len(samples), 40)})
    assert frames(*cut(samples, ends)) == frames(samples)


@pytest.mark.parametrize("turns_per_s", [1.0, -1.0])
def test_whole_cycles_have_a_frame_a_phase_however_samples_are_cut(turns_per_s):
    samples = walked(seconds=3.5, turns_per_s=turns_per_s)
    cycles = whole_cycles(["A", "B"], cut(samples, [700, 1234, 2900]))
    assert cycles == whole_cycles(["A", "B"], [samples])
    assert len(cycles) == 2  # the first one may have begun before the samples
    for cycle in cycles:
        places = np.array([motion.eccentricity_m for motion in cycle.joints["A"]])
        parts = np.arctan2(places[:, 1], places[:, 0]) * PHASES / (2.0 * np.pi)
        off = (parts - np.arange(PHASES) + PHASES / 2) % PHASES - PHASES / 2
        assert (off > -0.01).all() and (off < 1.01).all()


def test_an_impact_is_where_contact_began():
    found = frames(walked())
    hit = [frame.joints["A"].impact_n > 0.0 for frame in found]
    assert 0 < sum(hit) < len(hit) / 4
    assert not any(frame.joints["B"].impact_n for frame in found)


def test_a_whole_cycle_has_the_mean_torque_in_each_phase():
    cycles = [frame.torque for frame in frames(walked()) if frame.torque]
    assert len(cycles) == 2
    middle = np.sin((np.arange(PHASES) + 0.5) * 2.0 * np.pi / PHASES)
    assert np.array(cycles[1].predicted_nm) == pytest.approx(middle, abs=0.05)
    assert np.array(cycles[1].measured_nm) == pytest.approx(2.0 * middle, abs=0.1)


def test_there_is_no_frame_while_the_leg_is_not_followed():
    lost = walked(lost=[(500, 1000)])
    stamps = {(frame.stamp_ns - lost.stamp_ns[0]) // MS for frame in frames(lost)}
    assert not stamps & set(range(500, 1000))
    assert frames(*cut(lost, [700])) == frames(lost)


def test_a_frame_comes_back_from_its_message():
    for frame in frames(walked()):
        assert received_frame(frame.to_json(), "topic") == frame


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", "nan", "x" * 30_000, "[" * 5000,
     '{"stamp_ns":1,"crank_angle_rad":"<b>","joints":{},"torque":null}',
     '{"stamp_ns":1,"crank_angle_rad":1.0,"joints":{"A":{"eccentricity_m":[1.0],"force_n":1.0}}}',
     '{"stamp_ns":1,"crank_angle_rad":NaN,"joints":{},"torque":null}',
     json.dumps({"stamp_ns": 1, "crank_angle_rad": 1.0, "joints": {},
                 "torque": {"measured_nm": [1.0], "predicted_nm": [1.0]}})],
)  # fmt: skip
def test_what_is_no_frame_is_refused(text):
    with pytest.raises(ConfigError):
        received_frame(text, "topic")
