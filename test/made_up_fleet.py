"""A fleet that could be, of any size, without a recording: the same for the same seed."""

from pathlib import Path

import attrs
import numpy as np
from made_up_summary import made_up_summary

from leg_wear_monitor.fleet.overview import (
    BadRecording,
    FleetOverview,
    LegChange,
    LegOverview,
    RecordingHealth,
    counts_of,
    first_of,
)
from leg_wear_monitor.monitor.alarms import ADVICE
from leg_wear_monitor.state import Evidence, Figure, JointClearance, LifeHours, State, Verdict

NOW_NS = 1_795_000_000 * 10**9
DAY_NS = 86_400 * 10**9
JOINTS = ("A", "B", "G", "I", "J")
NEW_M, LIMIT_M = 3.0e-4, 6.0e-4

_WHY = {
    State.HEALTHY: "no alarm is raised, and the drive torque agrees with the counted leg: 0.046 of its RMS "
    "is not explained (limit 0.1)",
    State.WATCH: "the drive torque shows more friction: 0.42 N m ± 0.05 N m",
    State.NOT_MONITORED: "the fraction of unusable samples is 0.0972 (limit 0.05): NaN",
    State.INSPECT: "the growth of the clearance of joint {joint} is 12 um/h (limit 5 um/h)",
    State.STOP: "the counted clearance of joint {joint} is {clearance:.3g} mm (limit 0.6 mm)",
}
_CODES = {
    State.HEALTHY: "NONE",
    State.WATCH: "FRICTION_CHANGED",
    State.NOT_MONITORED: "INPUT",
    State.INSPECT: "GROWTH_{joint}",
    State.STOP: "CLEARANCE_{joint}",
}


def made_up_leg(name="leg-1", state=State.HEALTHY, used=None, age_days=0.5, p10_h=400.0, **changes):
    """A leg with a verdict; ``used`` is the fraction of each clearance."""
    used = used or dict.fromkeys(JOINTS, 0.2)
    worst = max(used, key=used.get)
    clearance_m = {joint: NEW_M + each * (LIMIT_M - NEW_M) for joint, each in used.items()}
    words = {"joint": worst, "clearance": 1e3 * clearance_m[worst]}
    joints = (worst,) if state in (State.INSPECT, State.STOP) else ()
    verdict = Verdict(
        state=state, joints=joints, why=_WHY[state].format(**words), since_ns=NOW_NS - 2 * DAY_NS,
        do=f"do what {state.words} asks for", evidence=(Evidence("torque_mismatch", 0.05, 0.1, ""),),
        not_valid=tuple(Figure) if state is State.NOT_MONITORED else (),
        fault_code=_CODES[state].format(**words),
    )  # fmt: skip
    end_ns = NOW_NS - int(age_days * DAY_NS)
    health = RecordingHealth(
        found=20, counted=20, begin_ns=end_ns - 20 * DAY_NS, end_ns=end_ns, counted_h=80.0, cycles=288_000
    )
    parts = {
        "verdict": verdict,
        "clearances": {
            joint: JointClearance(counted_m=each, new_m=NEW_M, limit_m=LIMIT_M)
            for joint, each in clearance_m.items()
        },
        "used_fraction": used,
        "life": {
            "leg": None
            if state is State.NOT_MONITORED
            else LifeHours(p10_h=p10_h, p50_h=2.2 * p10_h, p90_h=5.0 * p10_h)
        },
        "change": LegChange(recordings=1, state=state.value, used_fraction=dict.fromkeys(used, 0.002)),
        "recordings": health,
    }
    return LegOverview(id=name, **parts | changes)


def made_up_fleet(legs):
    """A fleet of some legs."""
    return FleetOverview(counts=counts_of(legs), first=first_of(legs), legs=tuple(legs), advice=ADVICE)


def random_fleet(number, seed=1):
    """A fleet with some legs of every kind."""
    draw = np.random.default_rng(seed)
    return made_up_fleet([_random_leg(draw, index) for index in range(number)])


def _random_leg(draw, index):
    name, lot = f"leg-{index:04d}", f"2026-{1 + index % 12:02d}"
    if draw.random() < 0.005:
        return LegOverview(id=name, lot=lot)
    states = [State.HEALTHY, State.WATCH, State.NOT_MONITORED, State.INSPECT, State.STOP]
    state = states[draw.choice(5, p=[0.9, 0.05, 0.02, 0.02, 0.01])]
    used = {joint: float(0.9 * draw.beta(1.5, 4.0)) for joint in JOINTS}
    if state is State.STOP:
        used[JOINTS[draw.integers(5)]] = float(draw.uniform(1.0, 1.3))
    leg = made_up_leg(
        name,
        state,
        used,
        age_days=float(draw.exponential(1.5)),
        p10_h=float(draw.lognormal(6.5, 1.0)),
        lot=lot,
    )
    return _with_history(draw, leg)


def _with_history(draw, leg):
    """The leg with its own growth, and one in ten with a recording that is not sound."""
    rise = {joint: float(draw.exponential(0.004)) for joint in leg.used_fraction}
    before = leg.state if draw.random() < 0.97 else State.WATCH.value
    leg = attrs.evolve(leg, change=LegChange(recordings=1, state=before, used_fraction=rise))
    if draw.random() > 0.1:
        return leg
    bad = BadRecording(file=f"{leg.id}/2026-11-20.mcap", outcome="unreadable", why="is not an MCAP file")
    return attrs.evolve(leg, recordings=attrs.evolve(leg.recordings, unreadable=1, bad=(bad,)))


def written_fleet(home: Path, names: str, *legs: LegOverview, lot: str = "") -> Path:
    """A description of legs with these names, and the fleet as an update left it; the leg a has a summary."""
    entries = (f"- {{id: {name}, recordings: {name}.mcap, lot: '{lot}'}}\n" for name in names)
    (home / "fleet.yaml").write_text(f"out: out\nlegs:\n{''.join(entries)}")
    for name in names:
        (home / f"{name}.mcap").touch()
    (home / "out/legs/a").mkdir(parents=True)
    (home / "out/legs/a/summary.json").write_text(made_up_summary().to_json())
    (home / "out/fleet.json").write_text(made_up_fleet(legs).to_json())
    return home
