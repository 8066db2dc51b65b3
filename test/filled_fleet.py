"""An overview of a fleet with something in every field."""

from made_up_summary import made_up_summary

from leg_wear_monitor.fleet.overview import (
    BadRecording,
    FleetOverview,
    LegChange,
    LegOverview,
    RecordingHealth,
)


def filled_fleet() -> FleetOverview:
    """Two legs, of which one has never walked."""
    summary = made_up_summary()
    bad = BadRecording(file="left/a.mcap", outcome="counted", why="ends at byte 7")
    left = LegOverview(
        id="left",
        lot="2026-03",
        verdict=summary.verdict,
        clearances=summary.clearances,
        used_fraction={"A": 0.7, "B": 0.3},
        life=summary.life,
        change=LegChange(recordings=1, state="healthy", fault_code="NONE", used_fraction={"A": 0.1}),
        recordings=RecordingHealth(found=2, counted=1, partial=1, cycles=2, bad=(bad,)),
    )
    counts = {"healthy": 0, "watch": 0, "not_monitored": 0, "inspect": 1, "stop": 0, "unknown": 1}
    return FleetOverview(
        counts=counts, first=("left",), legs=(left, LegOverview(id="right")), advice="advice"
    )
