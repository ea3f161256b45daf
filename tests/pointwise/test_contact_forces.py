"""The contact at the slider, from the same states: gaps, rates, slips, forces; all laws."""

import numpy as np
import pytest
from page_formulas import friction, journal_load, trapezoid, triangle
from press_states import Press, states
from reference_states import JOURNAL, Bearing, friction_regime, new_modes, slider_forces

from exudyn_model.clearances import corner_motion, journal_motion, new_contacts
from exudyn_model.five_bodies.contact import BEFORE, FRAME, STEP, ContactArrays, Partners
from exudyn_model.five_bodies.journal_contact import journal_force
from exudyn_model.five_bodies.slider_contact import slider_force
from exudyn_model.kernels import record
from exudyn_model.laws import slip_regime

LENGTH = 2e-6
EACH = 20  # of each situation and slip: 240 states a law
# A depth up to which the damping grows that half of the contacts are beyond; where the stiffness is given,
# with an exponent of its own.
ADAMS = {"contact.law": "adams-impact", "contact.damping_depth": 2e-6}
GIVEN = {"contact.stiffness": 2e12, "contact.exponent": 2.0, "contact.damping": 500.0}
LAWS = {
    "hertz-corners": {},
    "paper-switching": {"contact.law": "paper-switching"},
    "adams-impact": ADAMS,
    "adams-impact, stiffness given": ADAMS | GIVEN,
}
MATERIALS = {
    "contact.youngs_modulus": {"slider": 69e9, "guide": 190e9},
    "contact.poisson": {"slider": 0.33, "guide": 0.3},
    "mechanism.slider.thickness": 0.04,  # the width is 0.05 m
}


def corners_force(press, state, contacts, length=LENGTH, tick=0.0):
    """Force of the Exudyn model's corners in a step (s): its motion counts from the guide's centre line."""
    x, y, angle, *rates = state.slider if hasattr(state, "slider") else state
    step = np.array([(length, tick)], STEP)
    guide = Partners(4, 0.0, 0.0, FRAME, 0.0, 0.0, 0.0, 0.0, press.exudyn.guide)
    arrays = ContactArrays(step, record(guide), contacts, np.zeros(4, BEFORE), np.zeros(6))
    at = x - press.exudyn.mechanism.guide_x, y, angle
    return slider_force(at, tuple(rates), arrays)[:3]


DAMPING_MODELS = [{"contact.damping_model": name} for name in ("hunt-crossley", "flores", "gonthier")]


@pytest.mark.parametrize("changes", [{}, MATERIALS, ADAMS | MATERIALS, ADAMS | GIVEN, *DAMPING_MODELS])
def test_constants_of_the_contacts_are_those_of_the_page(changes):
    """Journal and bearing are both of the guide's material; a stiffness is of the law adams-impact alone."""
    press = Press({**changes, "joints.crank_pin": "clearance"})
    page, c, (guide, journal) = press.page, press.numbers, press.exudyn.contacts
    stiffnesses = guide.stiffness, guide.side_stiffness, journal.stiffness
    assert stiffnesses == pytest.approx((c.K, c.Ks, c.Kj), rel=1e-15)
    # The page subtracts 0.01 m from the bearing's 0.0102 m.
    assert stiffnesses == pytest.approx((page.K, page.K_s, page.K_j), rel=1e-14)
    if page.law == "adams-impact":
        damping = page.c_max, page.d_max
        assert (c.c_max, c.d_max) == damping
        assert [(of.damping, of.damping_depth) for of in (guide, journal)] == [damping, damping]
    else:
        assert (c.C, guide.damping, journal.damping) == pytest.approx((page.C, page.C, page.C), rel=1e-15)


def tilted(press, count):
    """Draw states with a corner or both of one side inside; yields side, state, motion of both corners."""
    c, mechanism, clearance = press.numbers, press.data["mechanism"], press.data["clearance"]["slider"]
    length, rng = mechanism["slider"]["length"], np.random.default_rng(7)
    for number in range(count):
        side = number % 2
        # Depths of the corners, from which x and angle follow to first order.
        depths = rng.uniform(-2e-5, 2e-5, 2)
        depths[rng.integers(2)] = rng.uniform(1e-8, 2e-5)
        outward = -1.0 if side == 0 else 1.0
        x = mechanism["guide_x"] + outward * (clearance + depths.mean())
        angle = outward * (depths[0] - depths[1]) / length
        # vy is the rods'; a rotation gives the wanted slip.
        place = (rng.uniform(0.0, 0.4), x, angle, rng.normal(0.0, 0.05))
        _, _, slip, arm, _ = press.corner(press.state(*place, 0.0, np.zeros(4)), side)
        wanted = rng.choice([-1.0, 1.0]) * (0.5 * c.v0, 0.5 * (c.v0 + c.v1), 0.1)[number % 3]
        speeds = rng.uniform(1e-2, 0.1) * np.isin(np.arange(4), [side, side + 2])
        state = press.state(*place, (wanted - slip) / arm, speeds)
        motion = {corner: press.corner(state, corner) for corner in (side, side + 2)}
        if max(-of[0] for of in motion.values()) > 0.0:
            yield side, state, motion


def tilted_corners(press, count):
    """Draw such states in which each corner that is inside is in contact by itself."""
    for _, state, motion in tilted(press, count):
        inside = [number for number, of in motion.items() if of[0] < 0.0]
        state.speeds[np.setdiff1d(range(4), inside)] = 0.0
        yield state


@pytest.mark.parametrize(
    ("law", "draw", "count"),
    [*((law, states, EACH) for law in LAWS), *((law, tilted_corners, 400) for law in LAWS if "adams" in law)],
)
def test_forces_of_the_corners_agree(law, draw, count):
    """Of both models, and by the page's formulas."""
    press, tilt = Press(LAWS[law]), draw is tilted_corners
    constants = press.exudyn.guide
    regimes, clipped, both_walls, shallow, deep = set(), 0, 0, 0, 0
    for state in draw(press, count):
        force, contacts = slider_forces(press.reference, state.slider, press.modes(state))
        gaps = contacts["gap"]
        # The drawn situation is the one that both models see.
        assert np.array_equal(gaps < 0.0, state.speeds > 0.0)
        for number in () if tilt else range(4):
            x, _, *rest = state.slider
            x -= press.exudyn.mechanism.guide_x
            gap, rate, slip, _, _ = corner_motion.py_func(number, x, *rest, constants)
            # Differences of coordinates of 0.55 m, of rates of up to 3 m/s.
            assert abs(gap - gaps[number]) <= 1e-15
            assert abs(rate - contacts["rate"][number]) <= 1e-15
            assert abs(slip - contacts["slip"][number]) <= 4e-15
            # And those of the page.
            own = press.corner(state, number)
            assert max(abs(gap - own[0]), abs(rate - own[1]), abs(slip - own[2])) <= 4e-15
        bound = press.force_bound(state)
        computed = np.array(corners_force(press, state, press.memory(state)))
        # Slips round four times as much in the page's own geometry, and where the slider is tilted.
        for value, share in ((computed, 4.0 if tilt else 1.0), (press.page_force(state), 4.0)):
            np.testing.assert_allclose(value[:2], force[:2], rtol=0, atol=share * bound)
            assert abs(value[2] - force[2]) <= 0.05 * share * bound  # of the arms, 0.043 m
        if not state.speeds.any():
            assert not force.any()
        regimes |= {friction_regime(press.numbers, s) for s in contacts["slip"][state.speeds > 0.0]}
        clipped += np.count_nonzero(contacts["normal"][state.speeds > 0.0] == 0.0)
        both_walls += contacts["normal"][[0, 2]].any() and contacts["normal"][[1, 3]].any()
        pushing = contacts["normal"] > 0.0
        shallow += np.count_nonzero(pushing & (-gaps < press.numbers.d_max))
        deep += np.count_nonzero(pushing & (-gaps > press.numbers.d_max))
    assert regimes == {-2, -1, 0, 1, 2}
    assert clipped >= (50 if tilt else 5)
    assert both_walls >= 20 or tilt
    assert min(shallow, deep) >= 40 or "adams" not in law or tilt


def test_forces_of_a_side_agree():
    """Law foundation: a side whose lower, upper or both corners are inside, closed by either of them."""
    press = Press({"contact.law": "foundation"})
    c = press.numbers
    regimes, clipped, partial = set(), 0, 0
    for side, state, motion in tilted(press, 400):
        d1, d2 = (-motion[number][0] for number in (side, side + 2))
        deep, other = max(d1, d2), min(d1, d2)
        weights = (trapezoid if other > 0.0 else triangle)(1.0, deep, other)[[0, 1] if d1 > d2 else [1, 0]]
        rate, slip = (weights @ [motion[side][k], motion[side + 2][k]] / weights.sum() for k in (1, 2))
        first, speed = side + 2 * int(d2 > d1), state.speeds[side]
        modes, memory = new_modes(), new_contacts(4)
        # Either model keeps it where it wants to: the Exudyn model in the row of the lower corner.
        memory["impact_speed"][side] = modes["speed"][first] = speed
        for number, depth in ((side, d1), (side + 2, d2)):
            modes["inside"][number] = depth > 0.0
        modes["regime"][first] = friction_regime(press.numbers, slip)
        pulls = 1.0 - c.C * rate / speed < 0.0
        modes["clipped"][first] = pulls
        computed, _ = slider_forces(press.reference, state.slider, modes)
        # K_s is the slope of the force by either depth, at most. Gaps round as above, slips on their ramp;
        # the shares, of slope 1 / (|d1| + |d2|), weigh the rates of two corners that may be 10 m/s apart.
        apart, elastic = (
            abs(motion[side][1] - motion[side + 2][1]) / (abs(d1) + abs(d2)),
            c.Ks * weights.sum(),
        )
        damping = 1.0 + c.C * abs(rate) / speed
        bound = 1e-15 * (damping * c.Ks + elastic * c.C / speed * (apart + 4.0))
        bound += elastic * damping * (1e-12 + 4e-15 / (c.v1 - c.v0))
        other = np.array(corners_force(press, state, memory))
        np.testing.assert_allclose(other[:2], computed[:2], rtol=0, atol=bound)
        assert abs(other[2] - computed[2]) <= 0.05 * bound
        regimes.add(int(modes["regime"][first]))
        clipped += pulls
        partial += min(d1, d2) < 0.0
    assert regimes == {-2, -1, 0, 1, 2}
    assert clipped >= 5
    assert partial >= 50


@pytest.mark.parametrize("law", [law for law in LAWS if law != "paper-switching"])
def test_forces_of_the_journal_agree(law):
    """Force, slip and point of attack at the crank pin: on rod 2 and, by its moment, on the crank."""
    # A damping that may clip the journal, too, whose stiffness is 20 times a corner's.
    press = Press({**LAWS[law], "joints.crank_pin": "clearance", "contact.damping": 3e4})
    c = press.numbers
    mechanism = press.exudyn.mechanism
    constants = press.exudyn.journal
    ends = Partners(0, mechanism.crank.to_tip, 0.0, 1, -mechanism.rod2.centroid, 0.0, 0.0, 0.0, constants)
    step = np.array([(LENGTH, 0.0)], STEP)
    arrays = ContactArrays(step, record(ends), new_contacts(1), np.zeros(1, BEFORE), np.zeros(6))
    rng = np.random.default_rng(5)
    regimes, clipped, closed, shallow = set(), 0, 0, 0
    for count in range(300):
        time = rng.uniform(0.0, 0.4)
        theta1 = c.theta0 + c.omega * time
        tip = c.L1 * np.exp(1j * theta1)
        depth = rng.uniform(1e-8, 3e-5) * (1 if count % 10 else -1)
        normal = np.exp(1j * rng.uniform(-np.pi, np.pi))
        bearing = tip - (c.pin_clearance + depth) * normal
        theta2, w2 = rng.uniform(-np.pi, np.pi), rng.normal(0.0, 10.0)
        # The bearing's velocity: what gives the wanted slip, a third each, and any approach.
        slip = (rng.uniform(-c.v0, c.v0), rng.uniform(c.v0, c.v1), rng.uniform(c.v1, 1.0))[count % 3]
        slip *= rng.choice([-1.0, 1.0])
        rate = rng.normal(0.0, 0.1)
        along = slip + w2 * c.bearing_radius - c.omega * (c.bearing_radius - abs(tip - bearing))
        velocity = 1j * c.omega * tip - (-rate + 1j * along) * normal
        computed = Bearing(press.reference, time, complex(bearing), complex(velocity), w2)
        speed = rng.uniform(1e-2, 0.1) if depth > 0.0 else 0.0
        modes, pulls = new_modes(), press.pulls(press.page.K_j, computed.gap, computed.rate, speed)
        modes[JOURNAL] = speed, friction_regime(c, computed.slip), pulls, depth > 0.0
        G, normal_force = computed.force(modes)
        crank, arm2 = c.Ls1 * np.exp(1j * theta1), c.Ls2 * np.exp(1j * theta2)
        rod2, vrod2, vcrank = bearing + arm2, velocity + 1j * w2 * arm2, 1j * c.omega * crank
        q1, q2 = (crank.real, crank.imag, theta1), (rod2.real, rod2.imag, theta2)
        v1, v2 = (vcrank.real, vcrank.imag, c.omega), (vrod2.real, vrod2.imag, w2)
        e, de = tip - bearing, 1j * c.omega * tip - velocity
        own_motion = journal_motion.py_func(e.real, e.imag, de.real, de.imag, c.omega, w2, constants)
        gap, gap_rate, material_slip, *_ = own_motion
        # Differences of coordinates below 0.2 m; of velocities of some m/s over a distance of 2e-4 m, whose
        # direction is rounded at 1e-16 / 2e-4.
        assert abs(gap - computed.gap) <= 1e-15
        direction = 1e-15 / c.pin_clearance
        assert abs(gap_rate - computed.rate) <= direction * 3.0
        assert abs(material_slip - computed.slip) <= direction * 3.0
        arrays.contacts["impact_speed"] = speed
        arrays.contacts["regime"] = slip_regime.py_func(material_slip, constants)
        force = np.array(journal_force((*q1, *q2), (*v1, *v2), arrays))
        bound, size, page = 0.0, 0.0, 0j
        if depth > 0.0:
            slope, damping, size = press.steepness(c.Kj, depth, computed.rate, speed)
            bound = slope * 1e-15 + damping * direction * 3.0
            bound += size * (1e-12 + direction + direction * 3.0 / (c.v1 - c.v0))
            by_page = press.page.damped(
                press.page.K_j, press.page.K_j * depth**press.page.n, depth, -computed.rate, speed
            )
            n = (computed.point - bearing) / c.bearing_radius
            page = journal_load(by_page, friction(*press.page.rub, by_page, computed.slip), n, 1j * n)
        assert abs(page - G) <= bound
        np.testing.assert_allclose(force[3:5], [G.real, G.imag], rtol=0, atol=bound)
        np.testing.assert_allclose(force[:2], -force[3:5], rtol=0, atol=0)
        # Both act in one point of the bearing's surface: moments about the bodies' centres.
        for moment, centre, sign in ((force[2], crank, -1.0), (force[5], rod2, 1.0)):
            arm = computed.point - centre
            assert abs(moment - sign * (arm.conjugate() * G).imag) <= abs(arm) * bound + size * 1e-15
        if depth > 0.0:
            closed += 1
            regimes.add(friction_regime(c, computed.slip))
            clipped += normal_force == 0.0
            shallow += normal_force > 0.0 and depth < c.d_max
    assert closed == 270
    assert regimes == {-2, -1, 0, 1, 2}
    assert clipped >= 5
    assert 5 <= shallow <= 200 or "adams" not in law


@pytest.mark.parametrize("law", ["hertz-corners", "foundation"])
@pytest.mark.parametrize("fraction", [0.01, 0.3, 0.999])
def test_a_touch_inside_a_step_has_the_speed_of_that_instant(law, fraction):
    """Constant acceleration: cubic gap and straight rate are exact. In a long step what was open has none."""
    press = Press({"contact.law": law, "friction.coefficient": 0.0})
    page, guide_x = press.page, press.exudyn.mechanism.guide_x
    step, acceleration, speed = 1e-5, 300.0, 0.02  # at the touch
    gap0 = speed * fraction * step - acceleration * (fraction * step) ** 2 / 2
    rest = (1 - fraction) * step
    depth, rate = speed * rest + acceleration * rest**2 / 2, speed + acceleration * rest
    contacts = new_contacts(4)
    contacts["gap"] = np.where(np.arange(4) % 2, gap0, 2 * page.c_T)
    contacts["rate"][[1, 3]] = acceleration * fraction * step - speed
    state = guide_x + page.c_T + depth, 0.0, 0.0, rate, 0.0, 0.0
    fx, _, _ = corners_force(press, state, contacts, step, step)
    elastic = 2 * page.K * depth**1.5 if law == "hertz-corners" else page.K_s * depth
    assert fx == pytest.approx(-elastic * (1 + page.C * rate / speed), rel=1e-6)
    assert corners_force(press, state, contacts, step, step / 2) == (0.0, 0.0, 0.0)
