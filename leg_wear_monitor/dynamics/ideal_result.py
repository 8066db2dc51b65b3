"""Simulation result of an ideal linkage."""

import numpy as np

from leg_wear_monitor.dynamics.result.parts import JointResult, ToeResult, TorqueResult, Trace
from leg_wear_monitor.dynamics.result.simulation_result import SimulationResult
from leg_wear_monitor.dynamics.run.protocol import Setup
from leg_wear_monitor.mechanism.ideal import TURN, IdealMotion, one_cycle, point_motion

_POINTS = 1440


def ideal_result(setup: Setup, cycles: float, trace: int) -> SimulationResult:
    """Result of the ideal motion, from the statistics of one cycle: all cycles are equal."""
    mechanism = setup.linkage.mechanism
    motion = one_cycle(setup.linkage, _POINTS, setup.speed)
    torque = motion.drive_torque
    force = np.linalg.norm(motion.joint_force, axis=2)
    return SimulationResult(
        mechanism=mechanism.name,
        model="ideal",
        speed_rpm=setup.speed * 60.0 / TURN,
        cycles=cycles,
        simulated_s=cycles * TURN / abs(setup.speed),
        drive_torque_nm=TorqueResult(
            mean=float(torque.mean()),
            rms=float(np.sqrt(np.mean(torque**2))),
            min=float(torque.min()),
            max=float(torque.max()),
            p99=float(np.percentile(torque, 99.0)),
            max_abs=float(np.abs(torque).max()),
            max_error=0.0,
        ),
        energy_j=None,
        toe=None if mechanism.toe is None else ToeResult(0.0, 0.0, 0.0),
        joints={
            name: JointResult(
                mean_force_n=float(force[:, i].mean()),
                rms_force_n=float(np.sqrt(np.mean(force[:, i] ** 2))),
                p99_force_n=float(np.percentile(force[:, i], 99.0)),
                max_force_n=float(force[:, i].max()),
            )
            for i, name in enumerate(mechanism.joints)
        },
        trace=_trace(setup, one_cycle(setup.linkage, trace, setup.speed), cycles) if trace else None,
    )


def _trace(setup: Setup, motion: IdealMotion, cycles: float) -> Trace:
    """Trace of all cycles, from the samples of one cycle in the crank's direction of rotation."""
    mechanism = setup.linkage.mechanism
    points = len(motion.crank_angle)
    turns = np.arange(round(cycles * points))
    pick = (turns if setup.speed > 0.0 else -turns) % points
    force = np.linalg.norm(motion.joint_force, axis=2)[pick]
    toe = None if mechanism.toe is None else point_motion(motion, setup.linkage, *mechanism.toe)[0][pick]
    return Trace(
        crank_angle_rad=np.sign(setup.speed) * turns * (TURN / points),
        toe_x_m=None if toe is None else toe[:, 0],
        toe_y_m=None if toe is None else toe[:, 1],
        drive_torque_nm=motion.drive_torque[pick],
        force_n={name: force[:, i] for i, name in enumerate(mechanism.joints)},
    )
