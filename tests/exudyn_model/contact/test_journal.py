"""The force in the crank pin's clearance, by itself and between two free bodies."""

import cmath

import numpy as np
import pytest

from exudyn_model.contact.friction import slip_regime
from exudyn_model.contact.journal import force_user_function, journal_force, journal_law
from exudyn_model.contact.memory import EVENT, update_pin
from exudyn_model.contact.states import PIN, contact_states
from exudyn_model.reading import read_scene

CRANK_PIN = {"joints.crank_pin": "clearance", "joints.slider": "ideal"}
STEP = 2e-6


def pin_parameters(make_scene, changes=None):
    return read_scene(make_scene(CRANK_PIN | (changes or {})))


def pin_state(parameters, direction, distance, angles):
    """Coordinates of crank and rod 2 whose pin is ``distance`` off centre, journal from bearing."""
    mechanism = parameters.mechanism
    crank, rod2 = 0.3 + 0.1j, 0.0
    rod2 = crank + mechanism.crank.to_tip * cmath.exp(1j * angles[0])
    rod2 -= distance * cmath.exp(1j * direction) - mechanism.rod2.centroid * cmath.exp(1j * angles[1])
    return [crank.real, crank.imag, angles[0], rod2.real, rod2.imag, angles[1]]


def closed_pins(parameters, count, seed):
    """Random states in contact: coordinates, velocities, memory whose regime fits the slip."""
    random, mechanism = np.random.default_rng(seed), parameters.mechanism
    radius = parameters.journal.radius + parameters.journal.clearance
    for _ in range(count):
        direction, angles = random.uniform(0, 2 * np.pi), random.uniform(0, 2 * np.pi, 2)
        distance = parameters.journal.clearance + random.uniform(1e-7, 3e-6)
        q = pin_state(parameters, direction, distance, angles)
        v = [*random.normal(0, 0.05, 2), random.normal(0, 1), *random.normal(0, 0.05, 2), random.normal(0, 1)]
        # Velocity of both materials in the same point, on the bearing's surface
        point = radius * cmath.exp(1j * direction)
        arm2 = point - mechanism.rod2.centroid * cmath.exp(1j * angles[1])
        arm1 = (
            point - distance * cmath.exp(1j * direction) + mechanism.crank.to_tip * cmath.exp(1j * angles[0])
        )
        relative = complex(*v[3:5]) + 1j * v[5] * arm2 - complex(*v[:2]) - 1j * v[2] * arm1
        slip = (relative * cmath.exp(-1j * direction)).imag
        contacts = contact_states()
        contacts[PIN]["impact_speed"] = 0.2
        contacts[PIN]["regime"] = slip_regime(slip, journal_law(parameters, STEP)[0])
        yield q, v, contacts, slip


def test_compiled_and_plain_form_agree(make_scene, plain_contact):
    parameters = pin_parameters(make_scene)
    law, seen = journal_law(parameters, STEP), 0
    for number, (q, v, contacts, _) in enumerate(closed_pins(parameters, 200, 3)):
        if number % 2:  # touched within the step
            contacts["impact_speed"], contacts["gap"], contacts["rate"] = 0.0, 1e-6, -0.2
        compiled = journal_force(tuple(q), tuple(v), law, contacts)
        plain = plain_contact.journal_force(q, v, parameters.journal, parameters.mechanism, STEP, contacts)
        # Depths down to 1e-7 m from coordinates of 0.3 m, rounded at 5e-17 m
        np.testing.assert_allclose(compiled, plain, rtol=1e-7, atol=1e-9)
        seen += compiled[3] != 0
    assert seen > 150  # the others part so fast that the force is clipped


def test_force_is_the_negative_gradient_of_the_elastic_energy(make_scene):
    elastic = {"contact.restitution": 1.0, "friction.coefficient": 0.0}
    parameters = pin_parameters(make_scene, elastic)
    law, journal, mechanism = journal_law(parameters, STEP), parameters.journal, parameters.mechanism

    def stored(q):
        crank_tip = complex(q[0], q[1]) + mechanism.crank.to_tip * cmath.exp(1j * q[2])
        bearing = complex(q[3], q[4]) - mechanism.rod2.centroid * cmath.exp(1j * q[5])
        depth = max(abs(crank_tip - bearing) - journal.clearance, 0)
        return journal.stiffness * depth**2.5 / 2.5

    for q, v, contacts, _ in closed_pins(parameters, 10, 5):
        force = np.array(journal_force(tuple(q), tuple(v), law, contacts))
        for number in range(6):
            dq = 1e-9 if number % 3 < 2 else 1e-8
            ends = [stored([*q[:number], q[number] + s * dq, *q[number + 1 :]]) for s in (-1, 1)]
            # Differences over 1e-9 m of depths from 1e-7 m on; round-off of 5e-17 m times forces of 1000 N
            # over 1e-9
            assert force[number] == pytest.approx(-(ends[1] - ends[0]) / (2 * dq), rel=1e-3, abs=2e-4)


def test_friction_takes_power_from_the_slip_of_both_materials(make_scene):
    """Arms and signs at once: the generalized forces' power is that of friction on the slip."""
    parameters = pin_parameters(make_scene)
    smooth = pin_parameters(make_scene, {"friction.coefficient": 0.0})
    law, without = journal_law(parameters, STEP), journal_law(smooth, STEP)
    seen = set()
    for q, v, contacts, slip in closed_pins(parameters, 100, 7):
        force, normal = (
            np.array(journal_force(tuple(q), tuple(v), each, contacts)) for each in (law, without)
        )
        ramp = min(max((abs(slip) - 1e-4) / 9e-4, 0), 1)
        lost = 0.15 * ramp * np.hypot(*normal[3:5]) * abs(slip)
        assert (force - normal) @ v == pytest.approx(-lost, rel=1e-8, abs=1e-10)
        # Action and reaction, and no moment about any point
        np.testing.assert_allclose(force[:2], -force[3:5], rtol=1e-14)
        moments = [
            f[2] + c.real * f[1] - c.imag * f[0]
            for f, c in ((force[:3], complex(*q[:2])), (force[3:], complex(*q[3:5])))
        ]
        assert sum(moments) == pytest.approx(0.0, abs=1e-11 * np.hypot(*force[:2]))
        seen.add(np.sign(slip))
    assert seen == {-1.0, 1.0}


@pytest.fixture
def rebound(make_scene, fly):
    """Function from restitution and steps to the ratio of two bodies' relative speeds, after over before."""

    def found(restitution, steps):
        changes = {
            "contact.restitution": restitution,
            "friction.coefficient": 0.0,
            "clearance.crank_pin": 1.0437e-5,
        }
        for rod in ("crank", "rod2"):
            changes[f"mechanism.{rod}.length"] = changes[f"mechanism.{rod}.centroid"] = 0.0
        speed, duration = 0.05, 4e-4
        parameters = pin_parameters(make_scene, changes)
        law, contacts, events = (
            journal_law(parameters, duration / steps),
            contact_states(),
            np.zeros(4, EVENT),
        )

        def update_journal(done, q, v, count):
            return update_pin(done * duration / steps, q, v, law, contacts, events, count)[0]

        # Obliquely, at no special angle
        velocities = [sign * speed * cmath.exp(0.7j) for sign in (0.5, -0.5)]
        force = force_user_function(law, contacts)
        v, count = fly([0.02, 0.1], velocities, force, update_journal, duration, steps, 8)
        assert count == 1
        return np.hypot(v[0] - v[3], v[1] - v[4]) / speed

    return found


# ln[(1+C)/(1-C e)] = C(1+e) with C = 3(1-c_e^2)/4, solved to ten digits
@pytest.mark.parametrize(("coefficient", "exact"), [(0.9, 0.9131766778), (0.1, 0.6652654068)])
def test_restitution_converges_to_the_exact_value_at_second_order(rebound, coefficient, exact):
    counts = [200, 400, 800, 1600, 3200]
    errors = [abs(rebound(coefficient, n) - exact) for n in counts]
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    # Where in its step the touch falls differs from step to step: the errors scatter about the line
    assert order == pytest.approx(2.0, abs=0.3), errors
    # 24 us of contact in 195 steps: (pi / 195)^2 / 12 = 2e-5 for a half-wave
    assert errors[-1] < 3e-5
