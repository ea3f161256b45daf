"""The contact's force law and geometry, without Exudyn."""

import math

import numpy as np
import pytest

from exudyn_model.contact.corners import slider_force
from exudyn_model.contact.gaps import contact_law
from exudyn_model.contact.impact_speed import touch
from exudyn_model.contact.laws import LAWS
from exudyn_model.contact.states import contact_states

STEP = 2e-6


def frozen(speed):
    """Corners that are all in contact since a touch at ``speed``."""
    corners = contact_states()
    corners["impact_speed"] = speed
    return corners


@pytest.mark.parametrize("kind", LAWS)
def test_compiled_and_plain_form_agree(kind, guide, slider, plain_contact):
    random = np.random.default_rng(7)
    law, seen, pairs = guide(law=kind), 0, 0
    for _ in range(300):
        q = [random.uniform(-3e-4, 3e-4), random.uniform(-0.1, 0.2), random.uniform(-4e-3, 4e-3)]
        v = [random.normal(0, 0.1), random.normal(0, 1e-3), random.normal(0, 3)]
        corners = contact_states()
        corners["impact_speed"] = random.choice([0.0, 0.02], 5)
        corners["gap"] = random.uniform(0, 1e-6, 5)
        corners["rate"] = -random.uniform(0.1, 0.2, 5)
        compiled = slider_force(q[0], q[2], *v, contact_law(law, slider, STEP), corners)
        plain = plain_contact.slider_force(q, v, law, slider, STEP, corners)
        seen += compiled[0] != 0
        sides = np.abs(q[0] + 0.035 * np.array([1, -1]) * q[2]) > 2e-4
        pairs += np.all(sides)
        # A gap is a difference of lengths of 0.025 m: round-off 1e-17 m of depths down to 1e-8 m
        np.testing.assert_allclose(compiled, plain, rtol=1e-8, atol=1e-12)
    assert seen > 100
    assert pairs > 10


@pytest.mark.parametrize(
    ("offset", "angle"), [(2.03e-4, 0.0), (-2.05e-4, 1e-5), (1e-5, 6e-3), (-3e-5, -6.1e-3), (2e-4, 2e-3)]
)
def test_force_is_the_negative_gradient_of_the_elastic_energy(offset, angle, guide, slider):
    """Without damping and friction: K depth^(n+1)/(n+1) a corner, whose depth the test finds itself."""
    law = guide(damping=0.0, friction=0.0)

    def energy(x, tilt):
        corners = np.array([[sx, sy] for sx in (-0.025, 0.025) for sy in (-0.035, 0.035)])
        rotation = np.array([[math.cos(tilt), -math.sin(tilt)], [math.sin(tilt), math.cos(tilt)]])
        horizontal = x + (corners @ rotation.T)[:, 0]
        depth = np.where(corners[:, 0] > 0, horizontal - 0.0252, -0.0252 - horizontal)
        return np.sum(law.stiffness * np.maximum(depth, 0) ** 2.5 / 2.5)

    dx, dturn = 1e-9, 3e-8
    fx = -(energy(offset + dx, angle) - energy(offset - dx, angle)) / (2 * dx)
    moment = -(energy(offset, angle + dturn) - energy(offset, angle - dturn)) / (2 * dturn)
    force = slider_force(offset, angle, 0.0, 0.0, 0.0, contact_law(law, slider, STEP), frozen(1.0))
    assert abs(fx) + abs(moment) > 1e-3
    # Differences over 1e-9 m of depths of some 1e-6 m: relative error near (1e-3)^2 / 24, and round-off
    np.testing.assert_allclose(force, [fx, 0.0, moment], rtol=1e-5, atol=1e-5)


def test_damping_follows_the_frozen_impact_speed_and_never_pulls(guide, slider):
    law = guide(friction=0.0)
    elastic = 2 * law.stiffness * (3e-6) ** 1.5  # both right corners, 3 um deep

    def pressure(vx, impact_speed):
        force = slider_force(2.03e-4, 0.0, vx, 0.0, 0.0, contact_law(law, slider, STEP), frozen(impact_speed))
        return -force[0] / elastic

    # Depths of 3e-6 m from lengths of 0.025 m: relative round-off 1e-12
    assert pressure(0.0, 0.05) == pytest.approx(1.0, rel=1e-10)
    assert pressure(0.05, 0.05) == pytest.approx(1.1425, rel=1e-10)
    assert pressure(-0.05, 0.1) == pytest.approx(1 - 0.1425 / 2, rel=1e-10)
    assert pressure(-1.0, 0.05) == 0.0


@pytest.mark.parametrize(
    ("slip", "ramp"), [(0.0, 0.0), (0.9e-4, 0.0), (5.5e-4, 0.5), (-5.5e-4, -0.5), (2.0, 1.0), (-2.0, -1.0)]
)
def test_friction_opposes_the_slip_with_the_paper_s_ramp(slip, ramp, guide, slider):
    law = guide()
    fx, fy, _ = slider_force(-2.03e-4, 0.0, 0.0, slip, 0.0, contact_law(law, slider, STEP), frozen(1.0))
    assert fx > 0
    assert fy == pytest.approx(-0.15 * ramp * fx, rel=1e-9)


def test_friction_sees_the_corner_s_own_velocity(guide, slider):
    """Rotation about the centre moves right corners along the guide by omega r_x, left ones the other way."""
    law = contact_law(guide(), slider, STEP)
    right = slider_force(2.03e-4, 0.0, 0.0, 0.0, 1.0, law, frozen(1.0))
    left = slider_force(-2.03e-4, 0.0, 0.0, 0.0, 1.0, law, frozen(1.0))
    assert right[1] < 0 < left[1]
    # Both push down the rotating side: moment r_x F_y of full friction, the normal forces' moments cancel
    # up to the damping of corners that rotate in and out (omega r_y = 0.035 m/s, impact speed 1 m/s)
    assert right[2] < 0
    assert left[2] < 0


@pytest.mark.parametrize("fraction", [1e-6, 0.3, 0.97])
def test_touch_speed_is_exact_for_constant_acceleration(fraction, guide, slider):
    law = contact_law(guide(), slider, 1e-3)[0]
    speed, acceleration = 0.04, 60.0
    touched = fraction * 1e-3
    gap = speed * touched + acceleration * touched**2 / 2
    end = gap - speed * 1e-3 - acceleration * 1e-6 / 2
    found, impact = touch(gap, -speed, end, -speed - acceleration * 1e-3, law)
    assert found == pytest.approx(fraction, rel=1e-8)
    assert impact == pytest.approx(speed + acceleration * touched, rel=1e-10)


def test_touch_speed_is_floored(guide, slider):
    law = contact_law(guide(), slider, 1e-3)[0]
    assert touch(1e-10, -1e-6, -1e-9, -1e-6, law)[1] == 1e-4
