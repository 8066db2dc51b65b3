"""Markers of the leg: its motion, its joints' levels and clearances, grey where nothing is known."""

import math
from itertools import pairwise

import attrs
import numpy as np
import pytest

import leg_wear_monitor as lw
from leg_wear_monitor.mechanism.position import build_linkage, ideal_motion
from leg_wear_monitor.mechanism.urdf import joint_positions
from leg_wear_monitor.messages.encode import CYLINDER, LINE_LIST, LINE_STRIP, SPHERE, TEXT, LegDrawing
from leg_wear_monitor.messages.leg_markers import LINKAGE, MARKERS, LegMarkers
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.reports import AlarmList, Lost, Reports, SampleReports
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin import CRANK

pytestmark = pytest.mark.plain

SECOND = 10**9
START = 1_700_000_000 * SECOND


@pytest.fixture(scope="module")
def monitor(leg):
    return lw.WearMonitor(leg, lw.MonitorConfig())


@pytest.fixture(scope="module")
def drawing(leg):
    return LegDrawing(leg)


def walk(at_s, joints, eccentricity_m=0.0):
    """One turn a second; nothing is known in the first 0.15 s."""
    angle = np.where(at_s < 0.15, math.nan, 2.0 * math.pi * (at_s % 1.0))
    off = np.zeros((len(at_s), joints, 2))
    off[..., 0] = np.where(np.isnan(angle), math.nan, eccentricity_m)[:, None]
    return SampleReports(
        stamp_ns=START + np.round(at_s * SECOND).astype(np.int64),
        kind=np.full(len(at_s), CRANK),
        crank_angle_rad=angle,
        predicted_torque_nm=angle,
        contact_force_n=np.ones((len(at_s), joints)),
        measured_torque_nm=angle,
        eccentricity_m=off,
    )


def reports(samples, alarms=()):
    lost = Lost(**{**{field.name: 0 for field in attrs.fields(Lost)}, "faulty": {}})
    return Reports(samples, (), alarms, lost)


def raised(at_s, level, joint="G"):
    alarm = Alarm(kind="clearance", subject=joint, unit="m", level=level)
    return AlarmList(START + round(at_s * SECOND), (alarm,))


@pytest.fixture
def drawn(store, monitor, drawing):
    """What several reports draw: stamp [s] and markers by name space."""

    def draw(*several):
        markers, found = LegMarkers(monitor, drawing), []
        for each in several:
            for outgoing in markers.of(each):
                if outgoing.output is not MARKERS:
                    continue
                assert len(outgoing.messages) == 1
                message = store.deserialize_cdr(outgoing.messages[0].tobytes(), outgoing.output.type)
                named = {}
                for marker in message.markers:
                    stamp = marker.header.stamp
                    assert stamp.sec * SECOND + stamp.nanosec == outgoing.stamp_ns[0]
                    assert marker.header.frame_id == "pelvis" and marker.color.a == 1.0
                    named.setdefault(marker.ns, []).append(marker)
                found.append(((outgoing.stamp_ns[0] - START) / SECOND, named))
        return found

    return draw


def xyz(point):
    return [point.x, point.y, point.z]


def rgb(marker):
    return marker.color.r, marker.color.g, marker.color.b


def test_the_leg_is_drawn_ten_times_a_second_and_moves(drawn, leg):
    found = drawn(reports(walk(np.arange(0.0, 1.0, 0.005), 5)))
    assert [at for at, _ in found] == pytest.approx(np.arange(10) / 10)
    markers = found[-1][1]
    kinds = {name: {marker.type for marker in each} for name, each in markers.items()}
    assert kinds == {
        "bodies": {LINE_LIST}, "joints": {SPHERE}, "names": {TEXT}, "toe_path": {LINE_STRIP},
        "bushings": {LINE_STRIP}, "journals": {CYLINDER}, "values": {TEXT}, "verdict": {TEXT},
    }  # fmt: skip
    assert all([marker.id for marker in each] == list(range(len(each))) for each in markers.values())
    # A and B sit on the hip's axis, which is the origin
    assert [marker.text for marker in markers["names"]] == ["A B", "G", "I", "J"]
    assert np.abs([xyz(marker.pose.position) for marker in markers["joints"][:2]]).max() < 1e-12
    # seven bodies: a line from the first point of each to each other one, and the pelvis
    lines = 1 + 2 + 2 + 1 + 2 + 2 + 1 + 1
    assert len(markers["bodies"][0].points) == 2 * lines
    knee = [xyz(named["joints"][2].pose.position) for _, named in found if len(named["joints"])]
    assert np.ptp(knee, axis=0)[0] > 0.1
    thigh = leg.bodies["thigh"].points
    assert np.linalg.norm(knee, axis=1) == pytest.approx(math.dist(thigh["B"], thigh["G"]))


def test_the_toe_keeps_to_its_path(drawn):
    found = drawn(reports(walk(np.arange(0.0, 1.0, 0.005), 5)))
    path = np.array([xyz(point) for point in found[-1][1]["toe_path"][0].points])
    assert path[0] == pytest.approx(path[-1])
    for _, named in found:
        ends = np.array([xyz(point) for point in named["bodies"][0].points])
        apart = np.linalg.norm(ends[:, None] - path[None], axis=2).min(axis=1)
        assert apart.min() < 1e-9  # one end of a line of the foot is the toe


def test_a_journal_at_its_clearance_touches_its_bushing(drawn, monitor, drawing):
    clearance_m = monitor.clearances_m[2]
    _, markers = drawn(reports(walk(np.arange(0.2, 0.4, 0.005), 5, clearance_m)))[-1]
    bushing, journal = markers["bushings"][2], markers["journals"][2]
    radius = math.hypot(bushing.points[0].x, bushing.points[0].z)
    off = np.array(xyz(journal.pose.position)) - xyz(bushing.pose.position)
    assert off[0] < 0.0 and np.abs(off[1:]).max() < 1e-12  # the leg's own x points backwards
    assert abs(off[0]) + 0.5 * journal.scale.x == pytest.approx(radius)
    assert journal.scale.x == journal.scale.y
    limit_m = max(monitor.clearance_limits_m)
    assert 1.0 - 0.5 * journal.scale.x / radius == pytest.approx(0.5 * clearance_m / limit_m)
    assert f"clearances x {0.5 * radius / limit_m:.3g}" in markers["verdict"][0].text
    # beside the leg, and not in each other
    centres = np.array([xyz(marker.pose.position) for marker in markers["bushings"]])
    assert centres[:, 0].min() - radius > drawing.lines[..., 0].max()
    assert min(math.dist(one, other) for one, other in pairwise(centres)) > 2.0 * radius


def test_a_level_has_a_text_a_colour_and_a_size(drawn):
    at_s, alarms = np.arange(0.2, 0.7, 0.005), (raised(0.35, Level.WARN), raised(0.45, Level.ERROR))
    found = [markers for _, markers in drawn(reports(walk(at_s, 5), alarms))]
    texts = [markers["values"][2].text for markers in found]
    assert texts == [f"G: {level} 0.300 mm" for level in ("OK", "OK", "WARN", "ERROR", "ERROR")]
    colours = [rgb(markers["joints"][2]) for markers in found]
    assert len({*colours}) == 3 and {rgb(markers["bushings"][2]) for markers in found} == {*colours}
    sizes = [markers["joints"][2].scale.x for markers in found]
    assert sizes == sorted(sizes) and len({*sizes}) == 3
    assert {rgb(markers["joints"][0]) for markers in found} == {colours[0]}


def test_what_is_not_followed_is_grey_where_it_was(drawn):
    at_s = np.concatenate([np.arange(0.0, 0.5, 0.005), np.arange(3.0, 3.195, 0.005)])
    samples = walk(at_s, 5)
    samples.crank_angle_rad[(at_s > 0.395)] = math.nan
    found = drawn(reports(samples))
    grey = {at: len({rgb(one) for each in named.values() for one in each}) == 1 for at, named in found}
    assert grey == {
        0.0: True,
        0.1: True,
        0.2: False,
        0.3: False,
        0.4: True,
        1.495: True,
        3.0: True,
        3.1: True,
    }
    words = [named["verdict"][0].text.split("\n")[0] for _, named in found]
    assert [word == "no current data" for word in words] == list(grey.values())
    assert {one.text.split(": ")[1] for one in found[-1][1]["values"]} == {"no data"}
    assert [xyz(one.pose.position) for one in found[-1][1]["joints"]] == [
        xyz(one.pose.position) for one in found[3][1]["joints"]
    ]


@pytest.mark.parametrize("cuts", [[], [50], [1, 2, 3, 61, 100, 139]])
def test_markers_are_the_same_however_reports_are_cut(monitor, drawing, cuts):
    """A change is reported with the first samples that are as late as it, or before."""
    at_s = np.concatenate([np.arange(50.0, 50.5, 0.005), np.arange(0.2, 0.7, 0.005)])  # the stamps jump back
    whole = walk(at_s, 5)
    changes = [
        (40, raised(50.2, Level.WARN)),
        (80, raised(50.4, Level.OK)),
        (98, raised(50.485, Level.ERROR)),
    ]
    changes += [(140, raised(0.4, Level.WARN))]

    def drawn_from(edges, *outputs):
        markers, rows = LegMarkers(monitor, drawing), []
        for begin, end in pairwise([0, *edges, len(at_s)]):
            fields = {one.name: getattr(whole, one.name)[begin:end] for one in attrs.fields(SampleReports)}
            known = tuple(change for at, change in changes if begin <= at < end)
            drawn = markers.of(reports(SampleReports(**fields), known))
            rows += [one.messages[0].tobytes() for one in drawn if one.output in outputs]
        return rows

    each = list(range(1, len(at_s)))
    assert drawn_from(cuts, MARKERS, LINKAGE) == drawn_from(each, MARKERS, LINKAGE)
    one_by_one = drawn_from(each, MARKERS)
    assert [b"G: WARN" in raw for raw in one_by_one] == [False] * 3 + [True] * 2 + [False] * 3 + [True] * 2
    assert [b"G: ERROR" in raw for raw in one_by_one] == [False] * 5 + [True] * 3 + [False] * 2


@pytest.mark.parametrize("name", ["andrews", "four_bar", "jansen_leg", "klann_leg", "slider_crank"])
def test_other_mechanisms_are_drawn_with_all_their_clearance_joints(name):
    mechanism = lw.load_mechanism(name)
    drawing = LegDrawing(mechanism)
    joints = len(mechanism.clearance_joints)
    assert drawing.rings.shape == (joints, 3)
    assert sum(len(text.split()) for text, _ in drawing.tags) == joints
    assert np.isfinite(drawing.lines).all() and drawing.lines.shape[1] > 0
    assert (len(drawing.path) > 0) == (mechanism.toe is not None)


def test_the_joints_of_the_robot_description_follow_the_crank(store, monitor, drawing, leg):
    """Beside each picture while the leg is followed; what the angles are is tested with the description."""
    at_s = np.arange(0.0, 1.0, 0.01)
    found = []
    for outgoing in LegMarkers(monitor, drawing).of(reports(walk(at_s, len(monitor.clearance_joints)))):
        if outgoing.output is LINKAGE:
            message = store.deserialize_cdr(outgoing.messages[0].tobytes(), outgoing.output.type)
            found.append(((outgoing.stamp_ns[0] - START) / SECOND, message))
    assert len(found) == 8  # of ten, two before anything is known
    linkage = build_linkage(leg)
    for at, message in found:
        q = ideal_motion(linkage, [2.0 * math.pi * at], 1.0).q
        expected = {joint: float(values[0]) for joint, values in joint_positions(linkage, q).items()}
        assert dict(zip(message.name, message.position, strict=True)) == pytest.approx(expected, abs=0.02)
        assert message.header.frame_id == "pelvis"
