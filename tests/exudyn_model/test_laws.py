"""The contact laws of a side, by the force of a slider: potentials, damping, friction, memory."""

import math

import exudyn as exu
import numpy as np
import pytest
from exudyn.itemInterface import (
    MarkerBodyRigid,
    NodeGenericData,
    NodeRigidBody2D,
    ObjectContactSphereTriangle,
    ObjectGround,
    ObjectRigidBody2D,
)
from hypothesis import given
from hypothesis import strategies as st

from exudyn_model.columns import CLOSED, GAP, IMPACT_SPEED, RATE
from exudyn_model.five_bodies.contact_forces import slider_force
from exudyn_model.laws import LAWS
from exudyn_model.memory import law_array, new_contacts
from exudyn_model.parameters import Contact

K, KS, C = 4.8e9, 2.88e10, 0.1425
WIDTH, LENGTH, CLEARANCE = 0.05, 0.07, 2e-4
FRICTIONLESS = {"friction": 0.0}


def guide(law, direction=0.0, **changes):
    """Constants of the paper's guide."""
    values = {
        "clearance": CLEARANCE, "stiffness": K, "exponent": 1.5, "damping": C, "damping_depth": 1e-5,
        "impact_speed_floor": 1e-4, "friction": 0.15, "static_speed": 1e-4, "transition_speed": 1e-3,
        "side_stiffness": KS,
    }  # fmt: skip
    contact = Contact(law=law, **(values | changes))
    return law_array(contact, 0.17, WIDTH / 2, LENGTH / 2, direction)


def touching(speed):
    """Memory of corners that have all been in contact since a touch at ``speed``."""
    contacts = new_contacts(4)
    contacts[:, IMPACT_SPEED], contacts[:, CLOSED] = speed, 1.0
    return contacts


def pressed(depths, law, rates=(0.0, 0.0), vy=0.0, speed=0.05):
    """Load of a slider whose right corners, lower and upper, have these depths (m) and rates (m/s)."""
    tilt = math.asin((depths[0] - depths[1]) / LENGTH)
    spin = (rates[0] - rates[1]) / (LENGTH * math.cos(tilt))
    x = CLEARANCE + sum(depths) / 2 + WIDTH * math.sin(tilt / 2) ** 2
    vx = sum(rates) / 2 + spin * math.sin(tilt) * WIDTH / 2
    return slider_force(x, 0.0, tilt, vx, vy, spin, np.array([1e-6, 1e-6]), law, touching(speed))


def forces(depths, law, **motion):
    """Normal forces of the two corners, from resultant and moment of a frictionless slider."""
    fx, _, moment = pressed(depths, law, **motion)
    tilt = math.asin((depths[0] - depths[1]) / LENGTH)
    # About the centre; both push along -x
    moment += fx * WIDTH / 2 * math.sin(tilt)
    apart = moment / (LENGTH / 2 * math.cos(tilt))
    return (-fx - apart) / 2, (-fx + apart) / 2


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("depths", [(3e-6, 1e-6), (2e-6, 2e-6), (5e-7, 4e-6), (3e-6, -1e-6), (-2e-6, 3e-6)])
def test_elastic_forces_are_the_derivatives_of_the_page_s_potential(law, depths):
    def stored(first, second):
        deeper, other = max(first, second), min(first, second)
        if law in ("hertz-corners", "adams-impact") or (law == "paper-switching" and other <= 0.0):
            return K / 2.5 * (max(first, 0.0) ** 2.5 + max(second, 0.0) ** 2.5)
        if other > 0.0:
            return KS / 6 * (first**2 + first * second + second**2)
        return KS * deeper**3 / (6 * (deeper - other))

    h, at = 1e-11, np.array(depths)
    exact = [(stored(*(at + side)) - stored(*(at - side))) / (2 * h) for side in h * np.eye(2)]
    computed = forces(depths, guide(law, **FRICTIONLESS, damping=0.0))
    # Differences of 1e-11 m of terms that round at 1e-16 of them
    np.testing.assert_allclose(computed, exact, rtol=1e-5, atol=1e-5 * max(exact))


@given(deeper=st.floats(1e-8, 1e-5), other=st.floats(-1e-5, 1e-5))
def test_the_foundation_s_forces_are_its_pressure_and_continuous(deeper, other):
    """K_s / L times the depth, where that is positive, by Gauss-Legendre over the part that is inside."""
    other = min(other, 0.99 * deeper)
    inside = min(1.0, deeper / (deeper - other)) if other < 0.0 else 1.0
    nodes, weights = np.polynomial.legendre.leggauss(4)
    place, weight = inside * (nodes + 1) / 2, inside * weights / 2
    pressure = KS * (deeper + (other - deeper) * place)
    exact = (weight @ (pressure * (1 - place)), weight @ (pressure * place))
    computed = forces((deeper, other), guide("foundation", damping=0.0, **FRICTIONLESS))
    # Depths are differences of 2e-4 m and of 1e-5 m: 1e-19 m; moments of arms of 0.04 m
    np.testing.assert_allclose(computed, exact, rtol=1e-8, atol=1e-8 * exact[0])


@pytest.mark.parametrize("law", ["hertz-corners", "foundation"])
def test_damping_follows_the_frozen_speed_and_never_pulls(law):
    depths = (1e-6, 1e-6)
    still = forces(depths, guide(law, **FRICTIONLESS))
    for rate, speed in ((0.02, 0.05), (-0.02, 0.05), (0.02, 0.5), (-0.3, 0.05), (-0.4, 0.05)):
        computed = forces(depths, guide(law, **FRICTIONLESS), rates=(rate, rate), speed=speed)
        factor = max(0.0, 1 + C * rate / speed)
        np.testing.assert_allclose(computed, np.multiply(still, factor), rtol=1e-9, atol=1e-9)
    assert forces(depths, guide(law), rates=(-0.4, -0.4)) == (0.0, 0.0)


@given(
    depths=st.tuples(st.floats(1e-8, 3e-5), st.floats(1e-8, 3e-5)),
    rates=st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)),
    speed=st.floats(1e-4, 1.0),
)
def test_the_damping_of_impact_follows_each_corner_s_depth_and_no_speed_of_a_touch(depths, rates, speed):
    c_max, d_max = 260.0, 1e-5
    law = guide("adams-impact", **FRICTIONLESS, damping=c_max, damping_depth=d_max)
    exact = []
    for depth, rate in zip(depths, rates, strict=True):
        # The cubic by its conditions: 0 and c_max at the ends, both without slope
        share = np.clip(np.polynomial.Polynomial([0, 0, 3, -2])(min(depth / d_max, 1.0)), 0.0, 1.0)
        exact.append(max(K * depth**1.5 + c_max * share * rate, 0.0))
    computed = forces(depths, law, rates=rates, speed=speed)
    # Depths are differences of 2e-4 m: 1e-19 m; rates of a tilted slider are sums of some m/s
    np.testing.assert_allclose(computed, exact, rtol=1e-8, atol=1e-8 * max(exact) + 1e-9)


@given(
    direction=st.floats(-3.1, 3.1), x=st.floats(-2.1e-4, 2.1e-4), vx=st.floats(-0.1, 0.1), vy=st.floats(-1, 1)
)
def test_a_rotated_guide_gives_the_rotated_force(direction, x, vx, vy):
    step, contacts, loads = np.array([1e-6, 1e-6]), touching(0.05), []
    for angle in (0.0, direction):
        turn = complex(math.cos(angle), math.sin(angle))
        place, rate, law = x * turn, complex(vx, vy) * turn, guide("hertz-corners", angle)
        motion = place.real, place.imag, angle, rate.real, rate.imag, 0.5
        fx, fy, moment = slider_force(*motion, step, law, contacts)
        force = complex(fx, fy) / turn
        loads.append((force.real, force.imag, moment))
    # Angles of 3 rad round at 4e-16: 3e-17 m of a corner, which counts in depths of 1e-9 m and more
    np.testing.assert_allclose(loads[1], loads[0], rtol=1e-5, atol=1e-3)


@pytest.mark.parametrize("law", ["hertz-corners", "foundation"])
@pytest.mark.parametrize("fraction", [0.01, 0.3, 0.999])
def test_a_touch_inside_a_step_has_the_speed_of_that_instant(law, fraction):
    """Constant acceleration: cubic gap and straight rate are exact. In a long step what was open has none."""
    step, acceleration, speed = 1e-5, 300.0, 0.02  # at the touch
    gap0 = speed * fraction * step - acceleration * (fraction * step) ** 2 / 2
    rate0 = -(speed - acceleration * fraction * step)
    rest = (1 - fraction) * step
    depth, rate = speed * rest + acceleration * rest**2 / 2, speed + acceleration * rest
    contacts = new_contacts(4)
    contacts[[1, 3], GAP], contacts[[1, 3], RATE] = gap0, rate0
    contacts[[0, 2], GAP] = 2 * CLEARANCE
    arguments = CLEARANCE + depth, 0.0, 0.0, rate, 0.0, 0.0
    fx, _, _ = slider_force(*arguments, np.array([step, step]), guide(law, **FRICTIONLESS), contacts)
    elastic = 2 * K * depth**1.5 if law == "hertz-corners" else KS * depth
    assert fx == pytest.approx(-elastic * (1 + C * rate / speed), rel=1e-6)
    assert slider_force(*arguments, np.array([step, step / 2]), guide(law), contacts) == (0.0, 0.0, 0.0)


def test_exudyn_s_own_contact_object_has_the_same_normal_force():
    """Lankarani and Nikravesh with coefficient e' = 1 - C / 1.5: 1 + 3/2 (1 - e') d'/v = 1 + C d'/v."""
    radius, depth, speed = 1e-4, 2e-6, 0.05
    mbs = exu.SystemContainer().AddSystem()
    start = {"initialCoordinates": [depth, 0.0, 0.0], "initialVelocities": [speed, 0.0, 0.0]}
    slider = ObjectRigidBody2D(mass=0.17, inertia=2.6e-5, nodeNumber=mbs.AddNode(NodeRigidBody2D(**start)))
    bodies = mbs.AddObject(slider), mbs.AddObject(ObjectGround())
    triangle = exu.Vector3DList()
    for y, z in ((-1.0, -1.0), (-1.0, 1.0), (2.0, 0.0)):
        triangle.Append([radius, y, z])
    memory = NodeGenericData(initialCoordinates=[1e-15, 0.0, 0.0, 0.0], numberOfDataCoordinates=4)
    contact = mbs.AddObject(
        ObjectContactSphereTriangle(
            markerNumbers=[mbs.AddMarker(MarkerBodyRigid(bodyNumber=body)) for body in bodies],
            nodeNumber=mbs.AddNode(memory), sphereRadius=radius, trianglePoints=triangle, includeEdges=0,
            impactModel=1, contactStiffness=K, contactStiffnessExponent=1.5,
            restitutionCoefficient=1 - C / 1.5, minimumImpactVelocity=1e-4,
        )
    )  # fmt: skip
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    integration = settings.timeIntegration
    integration.verboseMode, integration.numberOfSteps, integration.endTime = 0, 1, 1e-9
    integration.discontinuous.useRecommendedStepSize = integration.adaptiveStep = False
    mbs.SolveDynamic(settings)
    x, vx = mbs.systemData.GetODE2Coordinates()[0], mbs.systemData.GetODE2Coordinates_t()[0]
    force = np.linalg.norm(mbs.GetObjectOutput(contact, exu.OutputVariableType.Force))
    own = forces((x, x), guide("hertz-corners", **FRICTIONLESS), rates=(vx, vx))[0]
    # Its impact speed is that of the end of the step, 1e-9 s later; both sphere and triangle are lengths
    # of 1e-4 m and more
    assert force == pytest.approx(own, rel=1e-6)
