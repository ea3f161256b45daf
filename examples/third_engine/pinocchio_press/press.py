"""The press as a Pinocchio model: two branches from the frame, closed at joint B.

Crank and rod 2 are one branch, rocker, rod 4 and slider the other. Pinocchio gives the mass matrix, the
nonlinear effects and the Jacobians of the branches; the rows of the drive, of joint B and of an ideal guide
close the system; the recursive Newton-Euler algorithm then gives the force in every joint.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

Vector = NDArray[np.float64]
BODIES = {"O": "crank", "A": "rod2", "H": "rocker", "C": "rod4", "F": "slider"}
"""Joints in the order of the bodies that they move, 1 to 5; joint B closes the loop."""
PARENTS = {"O": None, "A": "O", "H": None, "C": "H", "F": "C"}


class Balance(NamedTuple):
    """Solution of the equations of motion at a state."""

    joint_rates: Vector
    """Second derivatives of the joints' angles, rad/s^2."""
    slider: Vector
    """Acceleration of the slider: x, y (m/s^2), angle (rad/s^2)."""
    torque: float
    """Of the motor on the crank, N m."""
    on_rocker: Vector
    """Force of rod 2 on the rocker, N."""
    guide: Vector
    """Force along x (N) and moment (N m) of an ideal guide on the slider; zeros with clearance."""


class Press:
    """Dynamics of the five bodies at given absolute angles and their rates."""

    def __init__(self, scene: Mapping[str, Any]) -> None:
        mechanism = scene["mechanism"]
        self.ideal_slider: bool = scene["joints"]["slider"] == "ideal"
        self.model = pin.Model()
        self.model.gravity.linear = np.array([0.0, -scene["environment"]["gravity"], 0.0])
        self.ids: dict[str, int] = {}
        # Angles of the joints from those of the bodies.
        self.relative = np.eye(5)
        for row, (joint, body) in enumerate(BODIES.items()):
            parent = PARENTS[joint]
            place = np.array([*mechanism["rocker_pivot"], 0.0]) if joint == "H" else np.zeros(3)
            if parent is not None:
                place[0] = mechanism[BODIES[parent]]["length"]
                self.relative[row, list(BODIES).index(parent)] = -1.0
            self.ids[joint] = self.model.addJoint(
                self.ids[parent] if parent else 0, pin.JointModelRZ(), pin.SE3(np.eye(3), place), joint
            )
            numbers = mechanism[body]
            centroid = np.array([numbers.get("centroid", 0.0), 0.0, 0.0])
            # Only the moment about z counts in the plane.
            inertia = pin.Inertia(numbers["mass"], centroid, numbers["inertia"] * np.eye(3))
            self.model.appendBodyToJoint(self.ids[joint], inertia, pin.SE3.Identity())
        self.end_of_rod2 = self._frame("A", mechanism["rod2"]["length"])
        self.centroid_of_rocker = self._frame("H", mechanism["rocker"]["centroid"])
        self.slider = self._frame("F", 0.0)
        self.data = self.model.createData()

    def _frame(self, joint: str, along: float) -> int:
        place = pin.SE3(np.eye(3), np.array([along, 0.0, 0.0]))
        frame = pin.Frame(f"{joint} {along}", self.ids[joint], 0, place, pin.FrameType.OP_FRAME)
        return int(self.model.addFrame(frame))

    def balance(self, angles: Vector, rates: Vector, load: Vector) -> Balance:
        """Solve the equations of motion under a load on the slider: force and moment about its centre."""
        q, v = self.relative @ angles, self.relative @ rates
        M, h = pin.crba(self.model, self.data, q), pin.nonLinearEffects(self.model, self.data, q, v)
        pin.computeJointJacobians(self.model, self.data, q)
        pin.forwardKinematics(self.model, self.data, q, v, np.zeros(5))
        pin.updateFramePlacements(self.model, self.data)
        J_slider, drift_slider = self._motion(self.slider)
        J_rocker, drift_rocker = self._motion(self.centroid_of_rocker)
        J_rod2, drift_rod2 = self._motion(self.end_of_rod2)
        rows = 5 if self.ideal_slider else 3
        J, drift = np.zeros((rows, 5)), np.zeros(rows)
        J[0, 0] = 1.0  # drive
        J[1:3], drift[1:3] = (J_rocker - J_rod2)[:2], (drift_rocker - drift_rod2)[:2]
        if self.ideal_slider:
            J[3:], drift[3:] = J_slider[[0, 2]], drift_slider[[0, 2]]
        matrix = np.zeros((5 + rows, 5 + rows))
        matrix[:5, :5], matrix[:5, 5:], matrix[5:, :5] = M, -J.T, J
        solution = np.linalg.solve(matrix, np.concatenate([J_slider.T @ load - h, -drift]))
        a, forces = solution[:5], solution[5:]
        guide = forces[3:] if self.ideal_slider else np.zeros(2)
        return Balance(a, J_slider @ a + drift_slider, forces[0], forces[1:3], guide)

    def _motion(self, frame: int) -> tuple[Vector, Vector]:
        """Return x, y, angle of a frame: Jacobian, and acceleration at constant rates of the joints."""
        J = pin.getFrameJacobian(self.model, self.data, frame, pin.LOCAL_WORLD_ALIGNED)
        drift = pin.getFrameClassicalAcceleration(self.model, self.data, frame, pin.LOCAL_WORLD_ALIGNED)
        return J[[0, 1, 5]], drift.vector[[0, 1, 5]]

    def reactions(self, angles: Vector, rates: Vector, load: Vector, at: Balance) -> dict[str, Vector]:
        """Return the force in each joint on the body with the higher number, N."""
        q, v = self.relative @ angles, self.relative @ rates
        pin.forwardKinematics(self.model, self.data, q)
        external = pin.StdVec_Force()
        external.extend([pin.Force.Zero() for _ in range(self.model.njoints)])
        on_slider = load + np.array([at.guide[0], 0.0, at.guide[1]])
        for frame, force, moment in (
            (self.end_of_rod2, -at.on_rocker, 0.0),
            (self.centroid_of_rocker, at.on_rocker, 0.0),
            (self.slider, on_slider[:2], on_slider[2]),
        ):
            joint, place = self.model.frames[frame].parentJoint, self.model.frames[frame].placement
            local_force = self.data.oMi[joint].rotation.T @ [*force, 0.0]
            external[joint] = place.act(pin.Force(local_force, np.array([0.0, 0.0, moment])))
        pin.rnea(self.model, self.data, q, v, at.joint_rates, external)
        result = {
            joint: (self.data.oMi[i].rotation @ self.data.f[i].linear)[:2] for joint, i in self.ids.items()
        }
        return result | {"B": at.on_rocker}

    def energies(self, angles: Vector, rates: Vector) -> tuple[float, float]:
        """Return kinetic and potential energy, J."""
        q, v = self.relative @ angles, self.relative @ rates
        return (
            float(pin.computeKineticEnergy(self.model, self.data, q, v)),
            float(pin.computePotentialEnergy(self.model, self.data, q)),
        )
