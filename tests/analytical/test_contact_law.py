"""Exact facts of the laws of contact for a point mass, and for the slider on its wall."""

import math

import numpy as np
import pytest
from closed_linkage import crank_angle, joints
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import exudyn_model
import reference_model
from reference_model.compiled import kernel
from reference_model.laws import damped_force, point_force
from reference_model.parameters import read_parameters

MASS, SPEED = 0.02, 0.03


FACTORS = {  # as published, see docs/model.md
    "lankarani-nikravesh": lambda c_e: 3.0 * (1.0 - c_e**2) / 4.0,
    "hunt-crossley": lambda c_e: 1.5 * (1.0 - c_e),
    "flores": lambda c_e: 8.0 * (1.0 - c_e) / (5.0 * c_e),
    "gonthier": lambda c_e: (1.0 - c_e**2) / c_e,
}


def exact_restitution(c_e, damping_model="lankarani-nikravesh"):
    """Root of ln[(1 + C)/(1 - C e)] = C (1 + e): energy and momentum balance, whatever m, K and n."""
    C = FACTORS[damping_model](c_e)
    highest = min(1.0, (1.0 - 1e-15) / C)  # there the logarithm's argument is infinite
    return float(brentq(lambda e: math.log((1.0 + C) / (1.0 - C * e)) - C * (1.0 + e), 0.01, highest))


def exact_depth(law, mass):
    """Largest depth of a damped hit, in closed form."""
    n, C = law.n, law.C
    return ((n + 1.0) * mass * SPEED**2 / law.K * (C - math.log1p(C)) / C**2) ** (1.0 / (n + 1.0))


@kernel
def normal_force(law, depth, rate, impact_speed):
    return damped_force(law, point_force(law.K, law.n, depth), depth, rate, impact_speed)


def hit(law, mass=MASS):
    """Integrate one hit of a point mass until it separates; scipy's solution object."""

    def separation(_, state):
        return state[0]

    separation.terminal, separation.direction = True, -1
    return solve_ivp(
        lambda _, s: [s[1], -normal_force(law, s[0], s[1], SPEED) / mass],
        (0.0, 1.0), [0.0, SPEED], method="DOP853", rtol=1e-12, atol=1e-16, events=separation,
        dense_output=True, first_step=1e-9, max_step=1e-6,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("c_e", "printed"), [(0.9, 0.9131766778), (0.5, 0.7252411140), (0.1, 0.6652654068), (0.7, None)]
)
def test_a_damped_hit_has_the_closed_form_s_restitution_and_depth(scene, c_e, printed):
    law = read_parameters(scene({"contact.restitution": c_e})).corners[0]
    exact, solution = exact_restitution(c_e), hit(law)
    if printed is not None:
        assert exact == pytest.approx(printed, abs=1e-10)  # the digits printed
    # rtol 1e-12 over some hundred steps
    assert -solution.y[1, -1] / SPEED == pytest.approx(exact, abs=1e-9)
    # The grid of the integrator (1e-6 s in a hit of 2e-4 s) misses the top by (pi/200)^2 / 8 at most.
    assert solution.y[0].max() == pytest.approx(exact_depth(law, MASS), rel=5e-5)


def test_elastic_hit_has_hertz_depth_and_duration(scene):
    law = read_parameters(scene({"contact.restitution": 1.0})).corners[0]
    solution = hit(law)
    assert -solution.y[1, -1] == pytest.approx(SPEED, rel=1e-10)  # rtol 1e-12, some hundred steps
    deepest = brentq(lambda t: solution.sol(t)[1], 0.0, solution.t[-1])
    assert solution.sol(deepest)[0] == pytest.approx((1.25 * MASS * SPEED**2 / law.K) ** 0.4, rel=1e-9)
    # 3.2181 is printed with five digits
    assert solution.t[-1] == pytest.approx(3.2181 * (MASS**2 / (law.K**2 * SPEED)) ** 0.2, rel=2e-5)


def tip_x(data):
    """x of the rocker's tip at the start, m."""
    return joints(data, crank_angle(data, 0.0))[2].real


def on_the_wall(scene, changes, model=reference_model):
    """The press with its crank all but at rest, rod 4 upright in the guide, thrown at the left wall."""
    still = {
        "drive.speed_rpm": 1e-9,  # a period of 6e10 s
        "drive.cycles": 1e-13,  # 6 ms
        "output.samples_per_cycle": 10**16,
        "clearance.slider": 1e-5,
        "initial.slider_offset": 0.0,
        "initial.slider_vx": -SPEED,
        "environment.gravity": 0.0,
        "friction.coefficient": 0.0,
        "solver.reference.tolerance": 1e-13,
        "mechanism.guide_x": tip_x(scene()),
    }
    result = model.simulate(scene(still | changes))
    assert result.status == "success", result.remedy
    return result


def mass_of_a_corner(scene):
    """Half of the effective mass, kg: that of rod 4 with the slider about C; two corners share the slider."""
    rod4, slider = (scene()["mechanism"][name] for name in ("rod4", "slider"))
    about = rod4["inertia"] + rod4["mass"] * rod4["centroid"] ** 2 + slider["mass"] * rod4["length"] ** 2
    return about / rod4["length"] ** 2 / 2.0


@pytest.mark.parametrize(("law", "contacts"), [("hertz-corners", 2), ("foundation", 1)])  # of a side
@pytest.mark.parametrize("damping_model", FACTORS)
@pytest.mark.parametrize("model", [reference_model, exudyn_model], ids=["reference", "exudyn"])
def test_a_damping_model_gives_its_restitution(scene, model, damping_model, law, contacts):
    """As below; a foundation is a spring of exponent 1, whose restitution is the same."""
    changes = {"contact.law": law, "contact.damping_model": damping_model, "contact.restitution": 0.6}
    result = on_the_wall(scene, TREE | changes, model)
    end = result.events["end"][:contacts].max()
    after = result.columns["slider_vx"][result.columns["time"] > end][0]
    assert after / SPEED == pytest.approx(exact_restitution(0.6, damping_model), abs=1e-8)


@pytest.mark.parametrize("c_e", [0.9, 0.5, 0.1])
def test_slider_bounces_off_its_wall_like_a_point_mass(scene, c_e):
    """Rod 4 upright: both left corners hit at once and the slider's effective mass is a constant."""
    restitution = {"contact.restitution": c_e}
    result, p = on_the_wall(scene, restitution), read_parameters(scene(restitution))
    events, exact = result.events, exact_restitution(c_e)
    assert list(events["corner"][:2]) == ["ll", "ul"]
    # Rod 4 is inclined by (1e-5 m)/(0.24 m) = 4e-5: effects of second order are 2e-9.
    assert events["start"][0] == pytest.approx(1e-5 / SPEED, rel=1e-8)
    after = result.columns["slider_vx"][(result.columns["time"] > events["end"][:2].max())][0]
    assert after / SPEED == pytest.approx(exact, abs=1e-8)
    mass = mass_of_a_corner(scene)
    np.testing.assert_allclose(events["impulse"][:2], mass * (SPEED + after), rtol=1e-8)
    assert events["largest_depth"][0] == pytest.approx(exact_depth(p.corners[0], mass), rel=1e-8)
    # The peak force by a fine scan of the same hit of a point mass; its instant is known to first order in C:
    # an error of second order in the force.
    solution = hit(p.corners[0], mass)
    fine = solution.sol(np.linspace(0.0, solution.t[-1], 20001))
    peak = max(normal_force(p.corners[0], d, v, SPEED) for d, v in fine.T)
    assert events["peak_force"][0] == pytest.approx(peak, rel=1e-3)


def impact_hit(mass, speed, k, n, c_max, d_max):
    """A hit by adams-impact: rebound speed, duration, largest depth and force; whether a wall would pull."""

    def force(d, v):
        s = min(max(d / d_max, 0.0), 1.0)
        return max(0.0, k * max(d, 0.0) ** n + c_max * (3.0 * s**2 - 2.0 * s**3) * v)

    def out(_, state):
        return state[0]

    out.terminal, out.direction = True, -1
    solution = solve_ivp(
        lambda _, state: [state[1], -force(*state) / mass], (0.0, 1.0), [0.0, speed], method="DOP853",
        rtol=1e-12, atol=1e-16, events=out, first_step=1e-9, max_step=5e-7, dense_output=True,
    )  # fmt: skip
    turn = brentq(lambda t: solution.sol(t)[1], 0.0, solution.t[-1])
    forces = [force(*state) for state in solution.sol(np.linspace(0.0, solution.t[-1], 20001)[1:-1]).T]
    hit = -solution.y[1, -1], solution.t[-1], solution.sol(turn)[0], max(forces)
    return *hit, min(forces) == 0.0


TREE = {
    "solver.exudyn.formulation": "tree",
    "solver.exudyn.method": "dopri5",
    "solver.exudyn.step": 1e-4,
    "solver.exudyn.tolerance": 1e-13,
}
# With the error of the restitution: of five bodies 6e-7 measured, four times that with a step of 5e-7 s
SOLVERS = {
    "reference": (reference_model, {}, 1e-8),
    "tree": (exudyn_model, TREE, 1e-8),
    "five bodies": (exudyn_model, {"solver.exudyn.step": 2.5e-7}, 1e-6),
}
# Stiffness, exponent, damping, its depth, and whether the wall would pull on the way out
HITS = [
    (4.6e9, 1.5, 260.0, 1e-5, False),
    (4.6e9, 1.5, 3e4, 1e-5, False),
    (1e9, 1.5, 50.0, 1e-6, True),
    (4.6e9 * 5e-6**-0.7, 2.2, 2600.0, 1e-5, True),
    (4.6e9 * 5e-6**0.5, 1.0, 2600.0, 1e-5, False),
]


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(("k", "n", "c_max", "d_max", "pulls"), HITS)
def test_a_bounce_by_adams_impact_is_that_of_a_point_mass(scene, solver, k, n, c_max, d_max, pulls):
    """As above, by each corner; the inclination makes 2e-9."""
    model, settings, error = SOLVERS[solver]
    law = {"stiffness": k, "exponent": n, "damping": c_max, "damping_depth": d_max, "law": "adams-impact"}
    result = on_the_wall(scene, settings | {f"contact.{key}": value for key, value in law.items()}, model)
    events, mass = result.events, mass_of_a_corner(scene)
    rebound, duration, depth, peak, clipped = impact_hit(mass, SPEED, k, n, c_max, d_max)
    assert clipped == pulls
    assert list(events["corner"][:2]) == ["ll", "ul"]
    after = result.columns["slider_vx"][(result.columns["time"] > events["end"][:2].max())][0]
    assert after / SPEED == pytest.approx(rebound / SPEED, abs=error)
    np.testing.assert_allclose(events["start"][:2], 1e-5 / SPEED, rtol=1e-8)
    exact = [duration, depth, mass * (SPEED + rebound), peak]
    values = [
        events["end"] - events["start"],
        *(events[k] for k in ("largest_depth", "impulse", "peak_force")),
    ]
    np.testing.assert_allclose(np.transpose(values)[:2], [exact, exact], rtol=10 * error)


def test_the_default_damping_of_adams_impact_is_the_one_that_the_page_says(scene):
    """K of Eq. 10; the damping is rounded to 10 N s/m, a 26th of the loss of 0.087."""
    k = 4.0 * math.sqrt(1e-3) / (3.0 * 2.0 * (1.0 - 0.28**2) / 210e9)
    law = [scene()["contact"][key] for key in ("exponent", "damping", "damping_depth")]
    assert impact_hit(0.0195, 0.07, k, *law)[0] / 0.07 == pytest.approx(0.913, abs=0.087 / 26)


def test_corner_hit_has_the_effective_mass_of_rod_and_slider(scene):
    """A frictionless hit by one corner: 1/m = sin^2(theta4) L4^2/I + r_y^2/J5, 0.0195 kg at the start."""
    p, tilt = read_parameters(scene()), 1e-3
    m, law = p.mechanism, p.corners[0]
    changes = {"initial.slider_angle": tilt, "contact.restitution": 1.0, "clearance.slider": 2e-4}
    events = on_the_wall(scene, changes | {"drive.cycles": 1.2e-13}).events
    assert events["corner"][0] == "ul"
    assert not np.any(events["start"][1:] < events["end"][0])  # one corner alone

    def effective(sine, ry):
        return 1.0 / (sine**2 * m.L4**2 / m.I4 + ry**2 / m.J5)

    ry = abs(law.y) * math.cos(tilt) - abs(law.x) * math.sin(tilt)
    # An elastic hit returns twice the momentum of the effective mass. The slider turns by 4e-4 rad in it,
    # which moves r_y by 4e-4 * 25 mm, 3e-4 of it.
    assert events["impulse"][0] == pytest.approx(2.0 * effective(1.0, ry) * SPEED, rel=1e-3)
    theta4 = math.acos((p.slider_start[0] - tip_x(scene())) / m.L4)
    # The digits printed
    assert effective(math.sin(theta4), abs(law.y)) == pytest.approx(0.0195, abs=5e-5)
