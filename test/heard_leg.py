"""A leg as the messages of its monitor tell it."""

from leg_wear_monitor.dashboard.received import received_status

NODE = "/left/leg_wear_monitor"


def status(name, message="", level=0, node=NODE, **values):
    texts = {key: str(value) for key, value in values.items()}
    return received_status(f"{node.lstrip('/')}: {name}", level, message, texts)


class Clock:
    """Seconds that pass when a test says so."""

    def __init__(self, now_s=1000.0):
        self.now_s = now_s

    def __call__(self):
        return self.now_s


def walk(leg, second=1, clearance_m=3.1e-4, **values):
    """A second of a healthy leg."""
    joints = [
        status(f"joint {joint}", "from the growth", clearance_m=clearance_m, clearance_limit_m=6e-4,
               clearance_max_m=clearance_m, believed_m=clearance_m, believed_by_counted=1,
               p10_hours=100, p50_hours=200, p90_hours=300)
        for joint in "ABGIJ"
    ]  # fmt: skip
    verdict = {"severity": 0, "since_s": 1.5, "torque_mismatch": 0.04, "torque_mismatch_limit": 0.1, **values}
    leg.take_diagnostics(
        second * 10**9,
        [
            status("verdict", "healthy: all is well. To do: nothing now", fault_code="NONE", **verdict),
            status("gait", "in step", cadence_rpm=60.0, cycles=second),
            status(
                "torque", "measured as predicted", mismatch=0.04, measured_rms_nm=8.0, predicted_rms_nm=8.1
            ),
            status("input", "in order"),
            *joints,
        ],
    )
    leg.take_cycle(
        {"counted_m": dict.fromkeys("ABGIJ", clearance_m), "peak_force_n": dict.fromkeys("ABGIJ", 9.0)}
    )
