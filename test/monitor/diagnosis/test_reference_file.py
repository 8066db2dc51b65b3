"""Files of torque references: what is written comes back, and what is no file of this leg is refused."""

from io import BytesIO

import attrs
import numpy as np
import pytest

from leg_wear_monitor import ConfigError, WearMonitor, load_mechanism
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.config.inputs import Load
from leg_wear_monitor.monitor.config.settings import MonitorConfig, TorqueDiagnosis
from leg_wear_monitor.monitor.diagnosis import reference_file
from leg_wear_monitor.monitor.diagnosis.reference_file import (
    BEFOREHAND_CYCLES,
    read_references,
    shipped_references,
    write_references,
)
from leg_wear_monitor.twin import torque_reference
from leg_wear_monitor.twin.reference import CrankProfile, LegParameters
from leg_wear_monitor.twin.sample import GROUND
from leg_wear_monitor.twin.torque_reference import TorqueReferenceRun
from leg_wear_monitor.wear import SECTORS


@pytest.fixture(scope="module")
def references(leg):
    """Two cycles a leg of the shipped reference: one as it is, one of other bodies at another cadence."""
    (shipped,) = shipped_references(leg)
    short = attrs.evolve(shipped, torque_nm=tuple(torque[:2] for torque in shipped.torque_nm))
    bodies = len(leg.bodies)
    identified = LegParameters(np.linspace(0.96, 1.04, bodies), np.full(bodies, 1.001), 1.4, 1.0e-3, 0.07)
    identified = attrs.evolve(identified, load=np.ones((128, 2)), load_sigma=0.2)
    profile = CrankProfile(-0.95 * TURN, np.linspace(0.0, 0.01, 8), np.zeros(8))
    return short, attrs.evolve(short, parameters=identified, profile=profile)


@pytest.fixture
def written(leg, references, tmp_path):
    with (tmp_path / "leg.npz").open("wb") as file:
        write_references(file, leg, references)
    return tmp_path / "leg.npz"


def test_references_come_back_as_they_were(leg, references, written) -> None:
    again = read_references(written, leg)
    for one, same in zip(references, again, strict=True):
        assert one.parameters == same.parameters
        assert one.parameters.load_sigma == same.parameters.load_sigma
        assert attrs.astuple(one.profile)[0] == same.profile.speed
        np.testing.assert_array_equal(one.profile.cosine, same.profile.cosine)
        np.testing.assert_array_equal(one.clearance_m, same.clearance_m)
        for torque, equal in zip(one.torque_nm, same.torque_nm, strict=True):
            np.testing.assert_array_equal(torque, equal)
    file = BytesIO()
    write_references(file, leg, again)
    assert file.getvalue() == written.read_bytes()
    # a mechanism file that lists its bodies in another order is of the same leg
    turned = attrs.evolve(leg, bodies=dict(reversed(leg.bodies.items())))
    mass = read_references(written, turned)[1].parameters.mass
    np.testing.assert_array_equal(mass, references[1].parameters.mass[::-1])


def test_a_file_of_another_leg_is_refused_where_it_is_named_and_left_alone_among_the_shipped(
    leg, written
) -> None:
    assert shipped_references(load_mechanism("jansen_leg")) == ()
    other = attrs.evolve(leg, clearance_joints=leg.clearance_joints[::-1])  # columns would be exchanged
    for mechanism in (load_mechanism("jansen_leg"), other):
        with pytest.raises(ConfigError, match=r"leg\.npz: has torque references of another leg \(bionic_leg"):
            read_references(written, mechanism)


def changed(path, **changes) -> None:
    with np.load(path) as parts:
        values = dict(parts)
    np.savez(path, **{name: value for name, value in (values | changes).items() if value is not None})


def one_array() -> bytes:
    file = BytesIO()
    np.save(file, np.zeros(3))
    return file.getvalue()


DAMAGES = {
    "text": lambda path: path.write_text("time,crank_angle\n"),
    "one array": lambda path: path.write_bytes(one_array()),
    "cut": lambda path: path.write_bytes(path.read_bytes()[:-3000]),
    "a byte": lambda path: path.write_bytes(
        path.read_bytes()[:9000] + bytes([path.read_bytes()[9000] ^ 255]) + path.read_bytes()[9001:]
    ),
    "no reference": lambda path: changed(path, references=np.array(0)),
    "a later format": lambda path: changed(path, format=np.array(99)),
    "not finite": lambda path: changed(path, mass_1=np.full(7, np.nan)),
    "a leg more": lambda path: changed(
        path, clearance_m_0=np.full((4, 5), 3e-4), torque_nm_0=np.ones((3, 2, 512), np.float16)
    ),
    "a leg less": lambda path: changed(path, clearance_m_0=np.full((3, 5), 3e-4)),
    "text as numbers": lambda path: changed(path, friction_0=np.array("much")),
    "a crank that stands": lambda path: changed(path, speed_radps_0=np.array(0.0)),
    "a body unknown": lambda path: changed(path, bodies=np.array(["crank"])),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_damaged_file_is_one_line(leg, written, damage) -> None:
    damage(written)
    with pytest.raises(
        ConfigError, match=r"leg\.npz: is not a file of torque references, or is damaged: ."
    ) as refused:
        read_references(written, leg)
    assert "\n" not in str(refused.value)


def test_a_missing_file_is_one_line(leg, tmp_path) -> None:
    with pytest.raises(ConfigError, match=r"none\.npz: cannot be read: No such file or directory$"):
        read_references(tmp_path / "none.npz", leg)


def test_a_monitor_begins_with_the_parameters_of_its_file(leg, references, written) -> None:
    diagnosis = TorqueDiagnosis(reference=str(written))
    parts = WearMonitor(leg, MonitorConfig(diagnosis=diagnosis, load=Load(model=GROUND)))._parts
    assert parts.torque.state.parameters == parts.twin.parameters == references[1].parameters
    given = [one.parameters == references[1].parameters for one in parts.torque._references._given]
    assert given == [False, True, False]  # both of the file, and the shipped one
    # they are of a leg under a load
    assert WearMonitor(leg, MonitorConfig(diagnosis=diagnosis))._parts.torque.state.parameters is None


def test_references_are_the_same_each_time_and_those_of_a_leg_at_each_cadence(leg, monkeypatch) -> None:
    monkeypatch.setattr(reference_file, "BEFOREHAND_CYCLES", 1)
    monkeypatch.setattr(torque_reference, "WIDER", (2.0,))
    monkeypatch.setattr(torque_reference, "_SETTLING", 0)
    leg, parts = attrs.evolve(leg, clearance_joints=("A", "G")), []  # fewer to be simulated
    one, two = reference_file.simulated_references(leg, (60.0, -57.0), parts.append)
    (again,) = reference_file.simulated_references(leg, (-57.0,))
    for torque, same in zip(two.torque_nm, again.torque_nm, strict=True):
        np.testing.assert_array_equal(torque, same)
    assert [len(torque) for torque in one.torque_nm] == [2, 1, 1] + (
        one.of_masses.size + one.of_frictions.size
    ) * [1]
    assert one.profile.cadence_rpm == pytest.approx(60.0)
    assert parts == sorted(parts) and parts[-1] == 1.0


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 7, 18])
def test_the_shipped_file_is_what_the_command_simulates(leg, number: int) -> None:
    """Means of the torque over 32 parts of the gait cycle and the mean step, within 7 standard errors.

    The motion is chaotic, so another machine has another course: between two files, made by two versions,
    the largest of 36 legs is 3.1 (2026-11-24), as of a normal distribution; 7 are exceeded by chance once in
    1e9 (Student's t, 78 degrees of freedom).
    """
    (shipped,) = shipped_references(leg)
    run = TorqueReferenceRun(leg, BEFOREHAND_CYCLES)
    run.begin(shipped.clearance_m[0], np.zeros((5, 2, SECTORS)), shipped.profile)
    np.testing.assert_array_equal([one.clearance_m for one in run.snapshot().legs], shipped.clearance_m)
    alone = run.snapshot()._replace(legs=(run.snapshot().legs[0], run.snapshot().legs[number]))
    run.restore(alone)
    made = run.finish()
    assert made is not None
    values = []
    for each in (made.torque_nm[1], shipped.torque_nm[number]):
        torque = each[:BEFOREHAND_CYCLES].astype(float)
        steps = np.log(np.abs(np.diff(torque, axis=1)).mean(axis=1))
        values.append(np.column_stack([torque.reshape(len(torque), 32, -1).mean(axis=2), steps]))
    one, other = values
    error = np.sqrt((one.var(axis=0, ddof=1) + other.var(axis=0, ddof=1)) / BEFOREHAND_CYCLES)
    assert (np.abs(one.mean(axis=0) - other.mean(axis=0)) < 7.0 * error).all()
