"""A leg as the messages of its monitor tell it."""

import attrs

from leg_wear_monitor.dashboard.live_leg import received_status
from leg_wear_monitor.state import (
    Evidence,
    JointClearance,
    LegAlarm,
    LegAlarms,
    LegState,
    Level,
    LifeHours,
    State,
    Verdict,
)

NODE = "/left/leg_wear_monitor"
HEALTHY = Verdict(
    state=State.HEALTHY, joints=(), why="all is well", since_ns=1_500_000_000, do="nothing now",
    evidence=(Evidence("torque mismatch", 0.04, 0.1, ""),), not_valid=(), fault_code="NONE",
)  # fmt: skip


def status(name, message="", level=0, node=NODE, **values):
    texts = {key: str(value) for key, value in values.items()}
    return received_status(f"{node.lstrip('/')}: {name}", level, message, texts)


class Clock:
    """Seconds that pass when a test says so."""

    def __init__(self, now_s=1000.0):
        self.now_s = now_s

    def __call__(self):
        return self.now_s


def state_of(second=1, clearance_m=3.1e-4, **verdict):
    """The state of a leg whose joints all have one clearance; healthy, unless its verdict is another."""
    joint = JointClearance(
        best_estimate_m=clearance_m, best_estimate_source="modelled", modelled_m=clearance_m, new_m=3.0e-4,
        limit_m=6.0e-4, status=State.HEALTHY,
    )  # fmt: skip
    return LegState(
        verdict=attrs.evolve(HEALTHY, **verdict),
        clearances=dict.fromkeys("ABGIJ", joint),
        life={**dict.fromkeys("ABGIJ", LifeHours(p10_h=100.0, p50_h=200.0, p90_h=300.0)), "leg": None},
        stamp_ns=second * 10**9,
        life_cycles=second,
    )


def raised(name, level=Level.ERROR, state="present"):
    """All alarms, of which one is raised at 0.7 mm."""
    alarm = LegAlarm(
        name=name, level=level, state=state, value=7e-4, limit=6e-4, unit="m", worst=7e-4, raised_ns=9 * 10**9
    )
    return LegAlarms(now=(alarm,))


def walk(leg, second=1, clearance_m=3.1e-4):
    """A second of a healthy leg."""
    leg.take_state(state_of(second, clearance_m).to_json())
    leg.take_diagnostics(
        second * 10**9,
        [
            status("verdict", HEALTHY.words, fault_code="NONE", severity=0),
            status("gait", "in step", cadence_rpm=60.0, cycles=second),
            status(
                "torque",
                ("the measured torque agrees with the prediction"),
                mismatch=0.04,
                measured_rms_nm=8.0,
                predicted_rms_nm=8.1,
            ),
            status("input", "in order"),
        ],
    )
