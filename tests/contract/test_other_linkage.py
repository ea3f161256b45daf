"""Another planar linkage, a slider-crank with clearance in its guide: by lists of either model, by hand."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from exudyn_model.five_bodies.settings import Settings
from exudyn_model.five_bodies.solver import run_system
from exudyn_model.five_bodies.system import Body, Drive, Pin, SliderContact, System
from exudyn_model.laws import Law
from reference_model import integrate
from reference_model.multiplier import FRAME, assemble
from reference_model.parameters import LAWS, read_parameters
from reference_model.recording import SAMPLE
from reference_model.running import new_run
from reference_model.state import contact_list

each_law = pytest.mark.parametrize("law", ["hertz-corners", "adams-impact"])
CRANK, ROD, OMEGA, ANGLE, GRAVITY = 0.05, 0.3, 12.0, 0.3, 9.81
"""Lengths in m; rad/s, rad at t = 0; m/s^2."""
WIDTH, LENGTH, CLEARANCE = 0.05, 0.07, 2e-4
"""Of the slider, m."""
BODIES = [(0.1, 2e-5), (0.2, 1.5e-3), (0.3, 5e-5)]
"""Crank, rod, slider: mass, inertia; kg, kg m^2."""


def start():
    """Return x, y, angle of the three bodies at t = 0, and their rates; the slider is on its line."""
    x, y = CRANK * math.cos(ANGLE), CRANK * math.sin(ANGLE)
    vx, vy = -OMEGA * y, OMEGA * x
    rod = math.acos(-x / ROD)
    w = vx / (ROD * math.sin(rod))
    reach, rate = ROD * math.sin(rod), ROD * w * math.cos(rod)
    places = [(x / 2, y / 2, ANGLE), (x / 2, y + reach / 2, rod), (0.0, y + reach, 1e-4)]
    return places, [(vx / 2, vy / 2, OMEGA), (vx / 2, vy + rate / 2, w), (0.0, vy + rate, 0.1)]


def by_lists(corners, baumgarte=(0.0, 0.0)):
    """Return the linkage from lists, and coordinates and rates at t = 0."""
    wall, mass = WIDTH / 2 + CLEARANCE, BODIES[2][1] / (LENGTH / 2) ** 2
    corners = tuple(corner._replace(wall=-corner.inward * wall, mass=mass) for corner in corners)
    model = assemble(
        bodies=BODIES,
        pins=[(0, (-CRANK / 2, 0.0), FRAME, (0.0, 0.0)), (1, (-ROD / 2, 0.0), 0, (CRANK / 2, 0.0)),
              (2, (0.0, 0.0), 1, (ROD / 2, 0.0))],
        guides=[],
        drive=(0, OMEGA, ANGLE),
        gravity=GRAVITY,
        baumgarte=baumgarte,
        loose=[(2, FRAME, (-1.0, 0.0, 0.0, 0.0))],
    )  # fmt: skip
    return model._replace(contacts=contact_list(corners), slider=2), np.ravel(start())


def by_hand(law, times):
    """x and angle of the slider from two coordinates, forces by either law; scipy from touch to touch."""
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
        return WIDTH / 2 + CLEARANCE + inward * x, inward * vx, inward, ry

    def derivative(t, y):
        force = moment = 0.0
        for k in range(4):
            gap, rate, inward, ry = corner(k, t, y)
            if speeds[k] and gap < 0.0:
                elastic, share = law.K * (-gap) ** 1.5, min(-gap / law.d_max, 1.0)
                damping = elastic * law.C / speeds[k]
                if law.law == LAWS.index("adams-impact"):
                    damping = law.c_max * (3.0 * share**2 - 2.0 * share**3)
                normal = max(0.0, elastic - damping * rate)
                force += inward * normal
                moment -= ry * inward * normal
        crank, phi = ANGLE + OMEGA * t, y[0]
        ax, ay = -CRANK * OMEGA**2 * math.cos(crank), -CRANK * OMEGA**2 * math.sin(crank) + GRAVITY
        turning = -first * (math.cos(phi) * ay - math.sin(phi) * ax) - ROD * math.sin(phi) * force
        return [y[2], y[3], turning / inertia, moment / J3]

    events = [lambda t, y, k=k: corner(k, t, y)[0] for k in range(4)]
    (_, (_, _, phi), (_, _, theta)), (_, (_, _, w), (_, _, spin)) = start()
    t, y, simulated = 0.0, [phi, theta, w, spin], []
    while t < times[-1]:
        for k, event in enumerate(events):
            event.terminal, event.direction = True, 1.0 if speeds[k] else -1.0
        run = solve_ivp(
            derivative, (t, times[-1]), y, "DOP853", rtol=3e-14, atol=1e-14, events=events, max_step=1e-3,
            dense_output=True,
        )  # fmt: skip
        inside = (times >= t) & (times < run.t[-1])
        simulated.append(run.sol(times[inside])[:2] if inside.any() else np.empty((2, 0)))
        t, y = run.t[-1] + (1e-13 if run.status == 1 else 0.0), run.y[:, -1]
        for k in range(4):
            if run.t_events[k].size:
                speeds[k] = 0.0 if speeds[k] else max(-corner(k, t, y)[1], law.speed_floor)
    phi, theta = np.concatenate(simulated, axis=1)
    return np.stack([CRANK * np.cos(ANGLE + OMEGA * times[: phi.size]) + ROD * np.cos(phi), theta])


def by_reference(corners, times, tolerance, baumgarte=(0.0, 0.0)):
    """The same at the times, and how many contacts have ended."""
    model, y0 = by_lists(corners, baumgarte)
    instants = np.array([[*times[:-1], np.inf], np.full(times.size, SAMPLE)])
    run = new_run(y0, 4, 1e-6, instants, 20_000)
    limits = integrate.Settings(tolerance, 0.01, 1000, 10**6)
    assert integrate.advance(model, run, limits, times[-1], times[-1]) == integrate.REACHED
    samples = np.flatnonzero(run.rows.purposes[: run.counters["recorded"][0]] & SAMPLE)
    np.testing.assert_allclose(run.rows.times[samples], times, rtol=0, atol=1e-16)
    slider = run.rows.slider[samples]
    return np.stack([slider["x"], slider["angle"]]), run.counters["contacts"][0]


def turn(vector, angle):
    """Return x and y turned about the crank's pivot, and the third number as it is."""
    (x, y, third), c, s = vector, math.cos(angle), math.sin(angle)
    return x * c - y * s, x * s + y * c, third


def by_exudyn(law, times, step, turned=0.0, gravity=GRAVITY):
    """The same by Exudyn's five-body builder, turned with its guide, and how many contacts there were."""
    name, damping = LAWS[int(law.law)], law.C
    if name == "adams-impact":
        damping = law.c_max
    own = Law(
        float(law.law), CLEARANCE, law.K, law.n, damping, law.speed_floor, law.c_f, law.v0, law.v1, law.d_max,
        half_width=WIDTH / 2, half_length=LENGTH / 2,
    )  # fmt: skip
    motion = zip(BODIES, *start(), strict=True)
    system = System(
        [Body(*body, turn((x, y, angle + turned), turned), turn(rate, turned))
         for body, (x, y, angle), rate in motion],
        [Pin("O", -1, (0.0, 0.0), 0, (-CRANK / 2, 0.0)), Pin("A", 0, (CRANK / 2, 0.0), 1, (-ROD / 2, 0.0)),
         Pin("B", 1, (ROD / 2, 0.0), 2, (0.0, 0.0))],
        [],
        [SliderContact(2, (0.0, 0.0), turned, own)],
        Drive(0, OMEGA),
        2,
        gravity,
    )  # fmt: skip
    ticks = round(times[1] / step)
    # Index 2, where Newton's tolerance is absolute: index 3 leaves 2.5e-9 of the weights unbalanced
    settings = Settings(
        "trapezoidal-index2", times[1], times.size - 1, 1.0, False, ticks, ticks, False, 1e-10, 1, 1e-8
    )
    recorder, _, outcome = run_system(system, settings)
    assert outcome.status == "success", outcome.remedy
    simulated = recorder.columns(("slider_x", "slider_y", "slider_angle"))
    across, _, angle = turn([simulated[f"slider_{name}"] for name in ("x", "y", "angle")], -turned)
    return np.stack([across, angle - turned]), len(recorder.event_table()["corner"])


@each_law
def test_the_reference_s_lists_are_the_linkage(scene, law):
    """Over some contacts without friction, against the solution by hand."""
    frictionless = {"contact.law": law, "friction.coefficient": 0.0}
    corners, times = read_parameters(scene(frictionless)).corners, np.linspace(0.0, 0.12, 601)
    simulated, contacts = by_reference(corners, times, 1e-12, baumgarte=(10.0, 10.0))
    exact = by_hand(corners[0], times)
    assert contacts >= 4
    # Two solutions at 1e-12 and 1e-14, whose difference ten contacts magnify to 4e-12 m and 3e-10 rad.
    x, angle = np.abs(simulated[:, : exact.shape[1]] - exact).max(axis=1)
    assert x < 1e-10
    assert angle < 1e-8


@each_law
def test_both_models_agree_on_a_slider_crank_to_their_uncertainties(scene, law):
    """Difference against what refinement moves either model by, largest so far: the rule of the verdicts."""
    corners, times = read_parameters(scene({"contact.law": law})).corners, np.linspace(0.0, 0.06, 301)
    (exact, _), (finer, _) = (by_reference(corners, times, tolerance) for tolerance in (1e-10, 1e-12))
    (five, contacts), (closer, _) = (by_exudyn(corners[0], times, step) for step in (2e-6, 1e-6))
    assert contacts >= 3
    moved = [np.maximum.accumulate(np.abs(a - b), axis=1) for a, b in ((exact, finer), (five, closer))]
    # A second-order method's error is 4/3 of what halving its step removes; round-off of x is some 1e-15 m
    u = np.hypot(moved[0], 4 / 3 * moved[1]) + 1e-14
    assert (u <= 0.01 * np.array([[CLEARANCE], [CLEARANCE / LENGTH]])).mean() >= 0.95
    assert (np.abs(exact - five) <= 2.0 * u).mean() >= 0.99


@pytest.mark.parametrize("turned", [1.0, -math.pi / 2, 2.5])
def test_five_bodies_turned_with_their_guide_move_as_before(scene, turned):
    corner, times = read_parameters(scene()).corners[0], np.linspace(0.0, 0.04, 201)
    (upright, contacts), other = (by_exudyn(corner, times, 5e-6, by, 0.0) for by in (0.0, turned))
    assert contacts == other[1] >= 2
    # Newton's tolerance, which impacts magnify
    for row, bound in ((0, 1e-8), (1, 1e-6)):
        np.testing.assert_allclose(other[0][row], upright[row], rtol=0, atol=bound)
