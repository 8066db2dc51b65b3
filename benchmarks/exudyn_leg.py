"""The leg in Exudyn (Gerstmayr, https://github.com/jgerstmayr/EXUDYN), set up from the package's own arrays.

Rigid bodies in the plane, gravity, the crank turning evenly. A clearance joint is `ObjectContactSphereSphere`
with a hollow sphere, which in the plane is a pin in a bushing: Hertz exponent 1.5, the package's stiffness
and hysteresis factor (Exudyn's Hunt-Crossley model with the restitution that gives this factor), friction
with the ramp's upper end. Two ways to keep the other joints together:

- ideal (`ObjectJointRevolute2D`), generalised-alpha: implicit, with Exudyn's discontinuous iterations;
- springs of a high stiffness, velocity Verlet: explicit. Springs softer than some 1e9 N/m change the impacts
  and with them the forces.

The crank's inertia is set to 1e6 kg m^2 so that it turns evenly by itself: cheaper than a constraint, and
without effect on anything but the drive torque. The compiled module without range checks is used.
"""

import sys

import attrs
import numpy as np
from watch import Watch

from leg_wear_monitor.dynamics.run import Setup
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import ideal_motion

sys.exudynFast = True  # type: ignore[attr-defined]
import exudyn  # noqa: E402
from exudyn import itemInterface as item  # noqa: E402, N813

FLYWHEEL = 1.0e6  # kg m^2


@attrs.frozen
class Scheme:
    """How Exudyn shall integrate: its step [s], and the stiffness [N/m] of springs for ideal joints or 0."""

    step: float
    penalty: float = 0.0

    @property
    def name(self) -> str:
        return f"springs {self.penalty:.0e} N/m, explicit" if self.penalty else "ideal joints, implicit"

    def settings(self, seconds: float, sampling: float) -> "exudyn.SimulationSettings":
        """Exudyn's settings, the best that were found for this leg with five clearance joints."""
        settings = exudyn.SimulationSettings()
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = sampling
        integration = settings.timeIntegration
        integration.numberOfSteps, integration.endTime = round(seconds / self.step), seconds
        integration.verboseMode = 0
        if self.penalty:
            integration.automaticStepSize = False
            integration.explicitIntegration.eliminateConstraints = False
            integration.explicitIntegration.useLieGroupIntegration = False
            integration.explicitIntegration.computeMassMatrixInversePerBody = True
            integration.discontinuous.iterationTolerance = 1.0e5
            integration.discontinuous.maxIterations = 3
            return settings
        # the tolerance is of |gap K|, in Exudyn's mixed units: contact and its end are met to 0.4 um
        integration.discontinuous.iterationTolerance = 3.0e4
        integration.newton.residualMode = 1  # convergence by increments of the coordinates
        integration.newton.modifiedNewtonContractivity = 0.25
        integration.generalizedAlpha.spectralRadius = 0.6
        integration.adaptiveStepRecoverySteps = 3
        integration.adaptiveStepIncrease = 1.5
        return settings


class ExudynLeg:
    """A leg at its ideal start.

    Parameters
    ----------
    setup : Setup
    penalty : float
        Stiffness of springs in place of ideal joints [N/m]; 0 for ideal joints.
    watched : bool
        Whether the contact forces are recorded.
    """

    def __init__(self, setup: Setup, penalty: float = 0.0, watched: bool = False) -> None:
        self._container = exudyn.SystemContainer()
        self._system = self._container.AddSystem()
        self._setup, self._penalty = setup, penalty
        self._bodies = [self._system.AddObject(item.ObjectGround())]
        self._add_bodies()
        objects = [self._add_joint(joint) for joint in range(len(setup.linkage.arrays.joint_kind))]
        clearance_joints = setup.contacts.joint if watched else []
        self._sensors = [self._watch(objects[joint]) for joint in clearance_joints]
        self._system.Assemble()

    def solve(self, scheme: Scheme, seconds: float) -> tuple[float, float]:
        """Move from the start for so long; returns what that took, as a watch reads it."""
        sampling = (2.0 * scheme.step if self._penalty else 1.0e-9) if self._sensors else 1.0e9
        settings = scheme.settings(seconds, sampling)
        kinds = exudyn.DynamicSolverType
        kind = kinds.VelocityVerlet if self._penalty else kinds.GeneralizedAlpha
        watch = Watch()
        self._system.SolveDynamic(settings, solverType=kind, showHints=False)
        return watch.read()

    def mean_forces(self, skipped: int, cycles: int) -> Floats:
        """Mean contact forces (cycles, k) [N] of each second after the first ones."""
        means = []
        for sensor in self._sensors:
            t, fx, fy = self._system.GetSensorStoredData(sensor)[:, :3].T
            force = np.hypot(fx, fy)
            impulse = np.append(0.0, np.cumsum(0.5 * np.diff(t) * (force[1:] + force[:-1])))
            means.append(np.diff(np.interp(skipped + np.arange(cycles + 1.0), t, impulse)))
        return np.array(means).T

    def _add_bodies(self) -> None:
        arrays, system = self._setup.linkage.arrays, self._system
        start = ideal_motion(self._setup.linkage, [0.0], self._setup.speed)
        for i in range(1, len(arrays.mass)):
            node = system.AddNode(
                item.NodeRigidBody2D(
                    referenceCoordinates=start.q[0, i].tolist(), initialVelocities=start.v[0, i].tolist()
                )
            )
            mass, _, inertia = arrays.mass[i].tolist()
            inertia = FLYWHEEL if i == arrays.drive_body else inertia
            body = item.ObjectRigidBody2D(nodeNumber=node, physicsMass=mass, physicsInertia=inertia)
            self._bodies.append(system.AddObject(body))
            marker = system.AddMarker(item.MarkerBodyMass(bodyNumber=self._bodies[i]))
            gravity = [*arrays.gravity.tolist(), 0.0]
            system.AddLoad(item.LoadMassProportional(markerNumber=marker, loadVector=gravity))

    def _watch(self, contact: int) -> int:
        """Record the force of a contact; returns the sensor."""
        force = exudyn.OutputVariableType.Force
        sensor = item.SensorObject(objectNumber=contact, storeInternal=True, outputVariableType=force)
        return int(self._system.AddSensor(sensor))

    def _add_joint(self, joint: int) -> int:
        """Add a joint, loose or not; returns its object."""
        arrays, system = self._setup.linkage.arrays, self._system
        clearance_joints = self._setup.contacts.joint.tolist()
        kind = item.MarkerBodyRigid if joint in clearance_joints else item.MarkerBodyPosition
        bushing, journal = (
            system.AddMarker(kind(bodyNumber=self._bodies[body], localPosition=[*point.tolist(), 0.0]))
            for body, point in zip(arrays.joint_body[joint], arrays.joint_point[joint], strict=True)
        )
        if joint in clearance_joints:
            return int(system.AddObject(self._contact(clearance_joints.index(joint), bushing, journal)))
        markers, k = [bushing, journal], self._penalty
        if not k:
            return int(system.AddObject(item.ObjectJointRevolute2D(markerNumbers=markers)))
        damping = 0.04 * float(np.sqrt(k))  # N s/m: 2 % of what is critical for 1 kg
        spring = {"stiffness": [k, k, 0.0], "damping": [damping, damping, 0.0]}
        return int(
            system.AddObject(item.ObjectConnectorCartesianSpringDamper(markerNumbers=markers, **spring))
        )

    def _contact(self, k: int, bushing: int, journal: int) -> item.ObjectContactSphereSphere:
        """Clearance joint k, a sphere (the journal) in a hollow sphere (the bushing)."""
        contacts = self._setup.contacts
        outer, clearance = float(contacts.bushing_radius[k]), float(contacts.clearance[k])
        inner = outer - clearance
        hertz = float(contacts.modulus[k]) * np.sqrt(inner * outer / clearance)
        node = item.NodeGenericData(initialCoordinates=[clearance, 0.0, 0.0, 0.0], numberOfDataCoordinates=4)
        return item.ObjectContactSphereSphere(
            markerNumbers=[journal, bushing],
            nodeNumber=self._system.AddNode(node),
            spheresRadii=[inner, outer],
            isHollowSphere1=True,
            contactStiffness=float(contacts.stiffness[k] or hertz),
            contactStiffnessExponent=1.5,
            impactModel=1,
            restitutionCoefficient=1.0 - float(contacts.hysteresis[k]) / 1.5,
            minimumImpactVelocity=float(contacts.speed_floor[k]),
            dynamicFriction=float(contacts.friction[k, 0]),
            frictionProportionalZone=float(contacts.friction[k, 2]),
        )
