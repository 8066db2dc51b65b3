"""What a replay could have found, without one."""

import math

import attrs
import numpy as np

from leg_wear_monitor.mechanism.materials import BushingLoad
from leg_wear_monitor.monitor.config.settings import Limits
from leg_wear_monitor.monitor.forecast.forecast import Answer, JointForecast, LegForecast, Quantiles
from leg_wear_monitor.monitor.forecast.wear_coefficients import CoefficientPrior
from leg_wear_monitor.monitor.ledger.entry import Measurement
from leg_wear_monitor.monitor.reports import ClearanceObservation, Lost
from leg_wear_monitor.recordings.findings import Finding, Severity
from leg_wear_monitor.recordings.result import (
    EncoderEvidence,
    LegJoint,
    ReplayGait,
    ReplayHistory,
    ReplayJoint,
    ReplayLeg,
    ReplayMonitor,
    ReplayRecording,
    ReplayStatus,
    ReplaySummary,
    WornDepth,
)
from leg_wear_monitor.recordings.summary import CYCLE_COLUMNS, SUMMARY_COLUMNS
from leg_wear_monitor.state import (
    AlarmChange,
    Drive,
    Estimate,
    Evidence,
    Figure,
    JointClearance,
    LegAlarm,
    LegAlarms,
    LegState,
    Level,
    LifeHours,
    State,
    TorqueDiagnosis,
    Verdict,
)

LIFE = Quantiles(1.0, 2.0, 3.0)


def made_up_state() -> LegState:
    """Joint A as encoders show it and with a remaining life; joint B with neither."""
    some = Estimate(value=1.0, sigma=0.1)
    alarm = LegAlarm(
        name="clearance A", level=Level.WARN, state="present", value=5e-4, limit=6e-4, unit="m",
        worst=math.nan, raised_ns=1_700_000_000_000_000_001,
    )  # fmt: skip
    return LegState(
        stamp_ns=1_700_000_000_000_000_003,
        life_cycles=9,
        verdict=Verdict(
            state=State.INSPECT, joints=("A",), why="why", since_ns=7, do="do", not_valid=(Figure.FORECAST,),
            evidence=(Evidence("clearance A", 5e-4, math.nan, "m"),), fault_code="CLEARANCE_CHANGED_A",
        ),
        clearances={
            "A": JointClearance(
                best_estimate_m=5e-4, best_estimate_sigma_m=1e-5, best_estimate_source="encoders",
                modelled_m=4e-4, estimated_m=5e-4, estimated_sigma_m=1e-5, estimated_by=("encoders",),
                new_m=3e-4, limit_m=6e-4, status=State.INSPECT,
            ),
            "B": JointClearance(
                best_estimate_m=4e-4, best_estimate_source="modelled", modelled_m=4e-4, new_m=3e-4,
                limit_m=6e-4, status=State.HEALTHY,
            ),
        },
        drive=Drive(
            scale=some, lag_s=some, coulomb_nm=some, viscous_nms=some, load_friction=some,
            bandwidth_hz=Estimate(value=30.0),
        ),
        diagnosis=TorqueDiagnosis(state="changed", cycles_not_used={"gap": 2}, misfit=0.2, cause="clearance"),
        life={"A": LifeHours(p10_h=1.0, p50_h=2.0, p90_h=3.0), "B": None},
        life_answers={"A": Answer.KNOWN.value, "leg": Answer.PARTLY_KNOWN.value},
        first_probability={"A": 1.0},
        alarms=LegAlarms(now=(alarm,), changes=(AlarmChange(stamp_ns=4, alarm=alarm),)),
    )  # fmt: skip


def made_up_summary() -> ReplaySummary:
    """Joint A as encoders show it and with a forecast; joint B with neither."""
    forecast = JointForecast(
        answer=Answer.KNOWN, cycles=LIFE, hours=LIFE, clearance_m=LIFE, measurements=1,
        prior=CoefficientPrior(sigma=0.7, basis="a judgement", holds_for="steel on steel (greased)"),
    )  # fmt: skip
    joint = ReplayJoint(
        opened_m=1e-4, growth_m_per_cycle=1e-12,
        growth_error_m_per_cycle=1e-13, growth_mps=None, forecast=forecast, peak_force_n=np.float64(9.0),
        mean_force_n=4.0, impacts=7,
        load=BushingLoad(
            mean_pressure_pa=1e6, p99_pressure_pa=2e6, mean_sliding_speed_mps=0.1,
            mean_pressure_speed_pa_mps=1e5, pressure_limit_pa=1.4e8,
        ),
        encoders=EncoderEvidence(
            observation=ClearanceObservation.SEEN, sigma_m=math.nan, departure_m=1e-4, believed=True,
            is_other=True,
        ),
    )  # fmt: skip
    stamps = np.array([1_700_000_000_000_000_001, 1_700_000_000_000_000_003])
    over_time = np.array([1.0, math.nan])
    columns = dict.fromkeys(CYCLE_COLUMNS, over_time)
    columns |= {name: {"A": over_time, "B": np.array([3.0, 4.0])} for name in SUMMARY_COLUMNS.values()}
    return ReplaySummary(
        **attrs.asdict(made_up_state(), recurse=False),
        recording=ReplayRecording(
            files=("a.mcap",), topics={"joint_states": "/joint_states"}, time="header", is_partial=True,
            findings=(Finding(file="a.mcap", text="ends at byte 7", weight=Severity.LOSS),),
            crank_samples=5, torque_samples=6, begin_ns=int(stamps[0]), end_ns=int(stamps[1]),
            duration_s=2e-9,
        ),
        monitor=ReplayMonitor(
            mechanism="leg", hardware_id="leg 1", clearance_joints=("A", "B"), commanded_rpm=60.0,
            wear_acceleration=1.0, bushing_radius_m={"A": 0.01, "B": 0.01},
            limits=Limits(joint_clearance_m=(5e-4, 6e-4)),
        ),
        leg=ReplayLeg(
            bodies_m={"thigh": ((0.0, 0.0), (0.0, -0.4)), "shank": ((0.0, -0.4), (0.1, -0.8), (-0.1, -0.8))},
            joints={
                "A": LegJoint(label="", place_m=(0.0, 0.0), is_on_ground=True),
                "B": LegJoint(label="knee", place_m=(0.0, -0.4), is_on_ground=False),
            },
        ),
        wall_s=0.5,
        real_time_factor=4e-9,
        cycles=2,
        gait=ReplayGait(believable_cycles=2, doubtful_cycles=0, missing="", is_counted=False),
        joints={"A": joint, "B": attrs.evolve(joint, forecast=None, encoders=None, peak_force_n=math.inf)},
        forecast=LegForecast(
            answer=Answer.PARTLY_KNOWN, cycles=LIFE, hours=LIFE, first_probability={"A": 1.0},
        ),
        measurements=(Measurement(7, "A", "ann", 3e-4, 1e-6, 0.0, 9, 0, 0.2, True, id=3),),
        status=(ReplayStatus(name="gait", level=Level.OK, message="m", values={"cadence_rpm": math.nan}),),
        lost=Lost(
            unmonitored_s=0.5, already_counted=0, faulty={"out_of_range": 1}, conflicting=0, implausible=0,
            torque_outliers=9, duplicates=1, late=2, stray_stamps=3, outliers=4, gaps_bridged=5, gaps_lost=6,
            backward_jumps=7, failures=8,
        ),
        history=ReplayHistory(stamp_ns=stamps, **columns),
        wear_depth_m={"A": WornDepth(np.array([1e-9, 0.0]), np.zeros(2))},
        advice="advice",
        made_with={"leg_wear_monitor": "1"},
    )  # fmt: skip
