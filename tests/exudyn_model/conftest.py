"""Scenes for the Exudyn model's tests, and what several of them hold the model against."""

from collections.abc import Callable
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

import exudyn as exu
import numpy as np
import pytest
from exudyn.itemInterface import NodeRigidBody2D, ObjectGenericODE2, ObjectRigidBody2D

from exudyn_model.bodies import PER_BODY, pins
from exudyn_model.five_bodies.settings import Steps, settings
from exudyn_model.parameters import Guide, Slider

PLAIN = Path(__file__).parents[2] / "benchmarks" / "plain_contact.py"


@pytest.fixture(scope="session")
def make_scene(scene: Callable[..., dict[str, Any]]) -> Callable[..., dict[str, Any]]:
    """Function from changes with dotted keys to a complete scene."""
    return scene


@pytest.fixture(scope="session")
def tree_scene(make_scene: Callable[..., dict[str, Any]]) -> Callable[..., dict[str, Any]]:
    """Function from tolerance and changes to a scene for a tree."""

    def scene(tolerance: float, changes: dict[str, object]) -> dict[str, Any]:
        tree = {"formulation": "tree", "method": "dopri5", "step": 1e-4, "tolerance": tolerance}
        return make_scene({f"solver.exudyn.{key}": value for key, value in tree.items()} | changes)

    return scene


@pytest.fixture(scope="session")
def error() -> Callable[..., float]:
    """Function from two results and a channel to the largest difference at a sample."""

    def largest(result: Any, exact: Any, name: str = "slider_y") -> float:
        return float(np.max(np.abs(result.columns[name] - exact.columns[name])))

    return largest


@pytest.fixture(scope="session")
def guide() -> Callable[..., Guide]:
    """Function from changes to the paper's guide."""

    def changed(**changes: Any) -> Guide:
        values = {
            "clearance": 2e-4,
            "stiffness": 4.8e9,
            "exponent": 1.5,
            "damping": 0.1425,
            "impact_speed": "frozen",
            "impact_speed_floor": 1e-4,
            "friction": 0.15,
            "static_speed": 1e-4,
            "transition_speed": 1e-3,
            "law": "hertz-corners",
            "side_stiffness": 2.88e10,
        }
        return Guide(**(values | changes))

    return changed


@pytest.fixture(scope="session")
def slider() -> Slider:
    """The paper's slider."""
    return Slider(mass=0.17, inertia=2.6e-5, length=0.07, width=0.05)


@pytest.fixture(scope="session")
def plain_contact() -> ModuleType:
    """The contact forces in plain Python, which the benchmarks keep."""
    spec = spec_from_file_location("plain_contact", PLAIN)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def fly() -> Callable[..., Any]:
    """Function that lets free bodies with an inertia of 1e-5 kg m^2 fly through one contact.

    Of masses (kg), velocities (m/s, complex), the user function of the contact, what updates its memory (from
    the number of the step, coordinates, rates and the count of events to that count), duration (s), number of
    steps, and uses of a Jacobian. Returns the bodies' rates at the end and the count of events.
    """

    def flown(
        masses: list[float],
        velocities: list[complex],
        force: Any,
        update: Callable[..., int],
        duration: float,
        steps: int,
        uses: int,
    ) -> tuple[Any, int]:
        container = exu.SystemContainer()
        mbs = container.AddSystem()
        nodes = []
        for mass, velocity in zip(masses, velocities, strict=True):
            rates = [velocity.real, velocity.imag, 0.0]
            nodes.append(mbs.AddNode(NodeRigidBody2D(initialVelocities=rates)))
            mbs.AddObject(ObjectRigidBody2D(mass=mass, inertia=1e-5, nodeNumber=nodes[-1]))
        size = PER_BODY * len(nodes)
        mbs.AddObject(
            ObjectGenericODE2(nodeNumbers=nodes, massMatrix=np.zeros((size, size)), forceUserFunction=force)
        )
        mbs.Assemble()
        count, done = 0, 0

        def before_step(mbs: Any, _: float) -> bool:
            nonlocal count, done
            data = mbs.systemData
            count = update(done, data.GetODE2Coordinates(), data.GetODE2Coordinates_t(), count)
            done += 1
            return True

        mbs.SetPreStepUserFunction(before_step)
        mbs.SolveDynamic(settings(Steps(duration, 1, steps), "generalized-alpha", 1e-9, uses))
        return mbs.systemData.GetODE2Coordinates_t(), count

    return flown


@pytest.fixture(scope="session")
def slider_accelerations() -> Callable[..., Any]:
    """Function that solves all 15 equations of motion and the constraints (Eqs. 14-21) for the slider.

    Of parameters, coordinates and rates, contact force and moment on the slider, and those on rod 2 where the
    crank pin has clearance: then the rows of joint A are left out. Returns ax, ay and alpha.
    """

    def solved(parameters: Any, q: Any, v: Any, slider_force: Any, pin_force: Any = (0.0, 0.0, 0.0)) -> Any:
        mechanism = parameters.mechanism
        mass, applied = np.zeros((15, 15)), np.zeros(15)
        bodies = [mechanism.crank, mechanism.rod2, mechanism.rocker, mechanism.rod4, mechanism.slider]
        for k, body in enumerate(bodies):
            mass[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = np.diag([body.mass, body.mass, body.inertia])
            applied[3 * k + 1] = -body.mass * mechanism.gravity
        applied[3:6] += pin_force
        applied[12:] += slider_force
        rows, gamma = [], []
        for pin in pins(mechanism):
            if pin.name == "A" and parameters.journal is not None:
                continue
            block, right = np.zeros((2, 15)), np.zeros(2)
            for sign, number, point in ((1, pin.second, pin.second_point), (-1, pin.first, pin.first_point)):
                if number >= 0:
                    angle, speed = q[3 * number + 2], v[3 * number + 2]
                    arm = point[0] * np.array([np.cos(angle), np.sin(angle)])
                    block[:, 3 * number : 3 * number + 3] += sign * np.array(
                        [[1, 0, -arm[1]], [0, 1, arm[0]]]
                    )
                    right += sign * speed**2 * arm
            rows.append(block)
            gamma.append(right)
        fixed = [2, 12, 14] if mechanism.ideal_slider else [2]
        jacobian = np.vstack([*rows, np.eye(15)[fixed]])
        count = len(jacobian)
        matrix = np.block([[mass, jacobian.T], [jacobian, np.zeros((count, count))]])
        return np.linalg.solve(matrix, np.concatenate([applied, *gamma, np.zeros(len(fixed))]))[12:15]

    return solved


@pytest.fixture(scope="session")
def mirrored() -> dict[str, Any]:
    """Changes that make the mirror image in the plane x = 0 of the paper's press."""
    return {
        "mechanism.rocker_pivot": [-0.2568, 0.2],
        "mechanism.guide_x": 0.55,
        "mechanism.reference_offset": -5e-5,
        "mechanism.crank_angle_deg": 180 - 111.36,
        "mechanism.rocker_branch": -1,
        "drive.speed_rpm": -150.0,
    }


@pytest.fixture(scope="session")
def linkage_points() -> Callable[..., tuple[Any, Any, Any, complex]]:
    """Joints A, B, C and H as complex numbers (m), from side lengths, on the paper's branches.

    Of a scene, the crank's angle (rad), and by how much (m) A is shifted.
    """

    def points(scene: dict[str, Any], angle: Any, shift: complex = 0.0) -> tuple[Any, Any, Any, complex]:
        linkage = scene["mechanism"]
        a = linkage["crank"]["length"] * np.exp(1j * angle) + shift
        h = complex(*linkage["rocker_pivot"])
        r2, r3 = linkage["rod2"]["length"], linkage["rocker"]["centroid"]
        d = abs(h - a)
        along = (d**2 + r2**2 - r3**2) / (2 * d)
        b = a + (along + 1j * np.sqrt(r2**2 - along**2)) * (h - a) / d
        return a, b, h + (b - h) * linkage["rocker"]["length"] / r3, h

    return points


@pytest.fixture(scope="session")
def ideal_y(linkage_points: Callable[..., tuple[Any, Any, Any, complex]]) -> Callable[..., Any]:
    """Ideal slider's y (m) of a scene, the crank's angle (rad) and the shift of A (m)."""

    def y(scene: dict[str, Any], angle: Any, shift: complex = 0.0) -> Any:
        linkage = scene["mechanism"]
        _, _, c, _ = linkage_points(scene, angle, shift)
        x = linkage["guide_x"] + linkage["reference_offset"]
        return c.imag - np.sqrt(linkage["rod4"]["length"] ** 2 - (x - c.real) ** 2)

    return y
