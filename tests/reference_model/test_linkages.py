"""Equations of motion: other linkages, the formulations against each other, constraints, reactions."""

import math

import numpy as np
import pytest
from listed_slider_crank import ANGLE, BODIES, CRANK, GRAVITY, OMEGA, ROD, by_lists
from listed_slider_crank import start as crank_start
from reference_states import friction_regime, in_state
from scipy.integrate import solve_ivp

from reference_model import integrate
from reference_model.compiled import kernel
from reference_model.contact import FRICTION, GAP, MEMORY, MODES, NORMAL, REGIME, SLIP, TAIL
from reference_model.events import ENDED, RECORDED
from reference_model.linkage import ideal_motion
from reference_model.multiplier import drift, press, solve_definite
from reference_model.observation import all_bodies
from reference_model.parameters import read_parameters
from reference_model.reactions import reactions
from reference_model.recording import PURPOSE, SAMPLE, SLIDER_FROM, TIME
from reference_model.running import formulation, start


def slider_crank_by_hand(law, times):
    """x and angle of the slider of a slider-crank with clearance: two coordinates, forces by Eqs. 1-11.

    Integrated by scipy from touch to touch; no friction. Rod and slider: phi, theta.
    """
    (_, _), (m2, J2), (m3, J3) = BODIES
    inertia, first = J2 + m2 * ROD * ROD / 4.0 + m3 * ROD * ROD, m2 * ROD / 2.0 + m3 * ROD
    speeds = [0.0] * 4

    def corner(k, t, y):
        phi, theta, w, spin = y
        inward, sx, sy = (1.0, -1.0)[k % 2], (-0.025, 0.025)[k % 2], (-0.035, 0.035)[k // 2]
        rx, ry = sx * math.cos(theta) - sy * math.sin(theta), sx * math.sin(theta) + sy * math.cos(theta)
        crank = ANGLE + OMEGA * t
        x = CRANK * math.cos(crank) + ROD * math.cos(phi) + rx
        vx = -CRANK * OMEGA * math.sin(crank) - ROD * w * math.sin(phi) - spin * ry
        gap = x - law.wall_left if k % 2 == 0 else law.wall_right - x
        return gap, inward * vx, inward, ry

    def derivative(t, y):
        force = moment = 0.0
        for k in range(4):
            gap, rate, inward, ry = corner(k, t, y)
            if speeds[k] and gap < 0.0:
                normal = law.K * (-gap) ** 1.5 * max(0.0, 1.0 - law.C * rate / speeds[k])
                force += inward * normal
                moment -= ry * inward * normal
        crank, phi = ANGLE + OMEGA * t, y[0]
        ax, ay = -CRANK * OMEGA**2 * math.cos(crank), -CRANK * OMEGA**2 * math.sin(crank) + GRAVITY
        turning = -first * (math.cos(phi) * ay - math.sin(phi) * ax) - ROD * math.sin(phi) * force
        return [y[2], y[3], turning / inertia, moment / J3]

    events = [lambda t, y, k=k: corner(k, t, y)[0] for k in range(4)]
    (_, (_, _, phi), (_, _, theta)), (_, (_, _, w), (_, _, spin)) = crank_start()
    t, y, found = 0.0, [phi, theta, w, spin], []
    while t < times[-1]:
        for k, event in enumerate(events):
            event.terminal, event.direction = True, 1.0 if speeds[k] else -1.0
        run = solve_ivp(
            derivative, (t, times[-1]), y, "DOP853", rtol=3e-14, atol=1e-14, events=events, max_step=1e-3,
            dense_output=True,
        )  # fmt: skip
        inside = (times >= t) & (times < run.t[-1])
        found.append(run.sol(times[inside])[:2] if inside.any() else np.empty((2, 0)))
        t, y = run.t[-1] + (1e-13 if run.status == 1 else 0.0), run.y[:, -1]
        for k in range(4):
            if run.t_events[k].size:
                speeds[k] = 0.0 if speeds[k] else max(-corner(k, t, y)[1], law.speed_floor)
    phi, theta = np.concatenate(found, axis=1)
    at = times[: phi.size]
    return CRANK * np.cos(ANGLE + OMEGA * at) + ROD * np.cos(phi), theta


def test_another_linkage_is_five_lists(scene) -> None:
    """A slider-crank with clearance in its guide, against two coordinates and scipy, over some contacts."""
    law = read_parameters(scene({"friction.coefficient": 0.0})).law
    model, law, y0 = by_lists(law, baumgarte=(10.0, 10.0))
    end, times = 0.12, np.linspace(0.0, 0.12, 601)
    instants = np.array([[*times[:-1], np.inf], np.full(601, SAMPLE)])
    run, work = integrate.new_run(y0, 1e-6, instants, 20_000)
    assert integrate.advance(model, law, run, work, end, end, 1e-12, 0.01, 1000, 10**6) == integrate.REACHED
    rows = run.rows[: run.counters[RECORDED]]
    samples = rows[(rows[:, PURPOSE].astype(int) & SAMPLE) > 0]
    x, theta = slider_crank_by_hand(law, times)
    assert run.counters[ENDED] >= 4
    moved, turned = samples[: x.size, SLIDER_FROM], samples[: x.size, SLIDER_FROM + 2]
    np.testing.assert_allclose(samples[:, TIME], times, rtol=0, atol=1e-16)
    # Two solutions at 1e-12 and 1e-14, whose difference ten contacts magnify to 4e-12 m and 3e-10 rad.
    assert np.abs(moved - x).max() < 1e-10
    assert np.abs(turned - theta).max() < 1e-8


@kernel
def solved(matrix, right):
    solve_definite(matrix, right)


def test_a_definite_system_is_solved_within_its_rounding() -> None:
    """Of random matrices A A^T: the error is at most n^2 rounding units times the condition number."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        factor, expected = rng.normal(size=(13, 13)), rng.normal(size=13)
        matrix = factor @ factor.T
        found = matrix @ expected
        solved(matrix.copy(), found)
        error = np.linalg.norm(found - expected) / np.linalg.norm(expected)
        assert error <= 13**2 * np.finfo(float).eps * np.linalg.cond(matrix)
    found = np.ones(2)
    solved(np.array([[4.0, 4.0], [4.0, 4.0]]), found)  # dependent rows: the last pivot is exactly zero
    assert not np.isfinite(found).any()


EACH = {
    "slider": {},
    "pin": {"joints.slider": "ideal", "joints.crank_pin": "clearance"},
    "both": {"joints.crank_pin": "clearance"},
    "multiplier": {"solver.reference.formulation": "multiplier"},
    "multiplier ideal": {"solver.reference.formulation": "multiplier", "joints.slider": "ideal"},
}
FREE = {"initial.slider_angle": 1e-3, "initial.slider_vx": 0.01, "initial.slider_omega": 0.5}
UNSTABILIZED = {"solver.reference.baumgarte_alpha": 0.0, "solver.reference.baumgarte_beta": 0.0}


def state_of(head):
    return np.concatenate([head, np.zeros(TAIL)])


@pytest.mark.parametrize("changes", EACH.values(), ids=EACH.keys())
def test_start_is_consistent(scene, changes) -> None:
    """Phi = 0 and Phi' = 0 at t = 0; also of a pin with clearance, which starts centred and at rest in it."""
    p = read_parameters(scene({**FREE, **changes}))
    model, _ = formulation(p)
    y = state_of(start(p, model))[:, None]
    bodies = all_bodies(model, p.mechanism, np.zeros(1), y, np.zeros_like(y))[:, :, 0]
    found = np.empty((2, 1))
    linkage = press(p.mechanism, ideal_slider=p.ideal_slider, baumgarte=(0.0, 0.0))
    drift(
        linkage, np.zeros(1), np.concatenate([bodies[:, :3].ravel(), bodies[:, 3:6].ravel()])[:, None], found
    )
    # A few roundings of coordinates up to 0.55 m and angles up to 3 rad; speeds up to 20 rad/s.
    assert found[0, 0] < 2e-15
    assert found[1, 0] < 2e-14


def evaluated(model, p, t, head, modes):
    """Return states of the contacts and motion of all bodies."""
    contacts, slider, bodies = in_state(model, p, t, head, modes)
    np.testing.assert_allclose(slider, bodies[4], rtol=1e-11, atol=1e-10)
    return contacts, bodies


def test_accelerations_and_reactions_of_minimal_and_multiplier_agree_from_the_same_state(scene) -> None:
    """200 states with random corners in contact: two coordinates against 15, body by body against -lambda."""
    p = read_parameters(scene(UNSTABILIZED))
    few, _ = formulation(p)
    many = press(p.mechanism, ideal_slider=False, baumgarte=(0.0, 0.0))
    head0, rng, touched = start(p, few), np.random.default_rng(0), 0
    for _ in range(200):
        modes, t = np.zeros(MODES), rng.uniform(0.0, p.period)
        modes[MEMORY : MEMORY + 4] = rng.choice([0.0, 1.0], 4) * rng.uniform(0.01, 0.05, 4)
        head = head0 + rng.normal(size=4) * np.array([5e-4, 2e-3, 0.1, 1.0])
        head[0] += (
            ideal_motion(p.mechanism, np.array([t]))[3, 2, 0]
            - ideal_motion(p.mechanism, np.zeros(1))[3, 2, 0]
        )
        contacts, _ = evaluated(few, p, t, head, modes)
        modes[REGIME : REGIME + 4] = [friction_regime(p.law, slip) for slip in contacts[SLIP : SLIP + 4]]
        contacts, bodies = evaluated(few, p, t, head, modes)
        _, others = evaluated(
            many, p, t, np.concatenate([bodies[:, :3].ravel(), bodies[:, 3:6].ravel()]), modes
        )
        normal, friction = contacts[NORMAL : NORMAL + 4], contacts[FRICTION : FRICTION + 4]
        touched += normal.any()
        # Gaps are differences of 0.55 m coordinates and round at some 1e-16 m; a force amplifies that by
        # 1.5 K sqrt(depth), an acceleration by the smallest effective inertia on top; 1e-11 of scale remains.
        depth = max(0.0, -contacts[GAP : GAP + 4].min())
        force = 4 * (1.5 * p.law.K * np.sqrt(depth) * 1e-15 + 1e-12 * normal.max())
        np.testing.assert_allclose(others[:, 6:8], bodies[:, 6:8], rtol=0, atol=force / 0.02 + 1e-11 * 500)
        np.testing.assert_allclose(
            others[:4, 8], bodies[:4, 8], rtol=0, atol=force / 0.02 / 0.045 + 1e-11 * 1e4
        )
        np.testing.assert_allclose(
            others[4, 8], bodies[4, 8], rtol=0, atol=force * 0.05 / p.mechanism.J5 + 5e-7
        )
        Fx = normal[0] + normal[2] - normal[1] - normal[3]
        found = reactions(
            p.mechanism, bodies[:, :, None], Fx, friction.sum(), ideal_slider=False, journal=None
        )[:13, 0]
        # Rows are in the order O, A, H, B, C, F; the channels in O, A, B, H, C, F.
        order = [0, 1, 2, 3, 6, 7, 4, 5, 8, 9, 10, 11, 12]
        # Ten times the largest measured: a hundredth of the force's bound, 1e-13 of what the joints bear.
        np.testing.assert_allclose(
            found, -many.lambdas[order], rtol=0, atol=0.1 * force + 1e-12 * (50 + abs(Fx))
        )
    assert touched > 20
