"""Exact facts of the laws of contact: on its wall the slider bounces like a point mass."""

import math

import numpy as np
import pytest
from page_engine import Engine
from page_formulas import DAMPING, Numbers
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import exudyn_model
import reference_model

SPEED = 0.03
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


def tip_x(data):
    """x of the rocker's tip at the start, m."""
    mechanism = data["mechanism"]
    return mechanism["rocker_pivot"][0] + mechanism["rocker"]["length"] * math.cos(Engine(data).start()[8])


def on_the_wall(scene, solver, changes):
    """The press with its crank all but at rest, rod 4 upright in the guide, thrown at the left wall."""
    model, settings, _ = SOLVERS[solver]
    rest = {
        "drive.speed_rpm": 1e-9,  # a period of 6e10 s
        "drive.cycles": 5e-14,  # 3 ms
        "output.samples_per_cycle": 10**16,
        "clearance.slider": 1e-5,
        "initial.slider_offset": 0.0,
        "initial.slider_vx": -SPEED,
        "environment.gravity": 0.0,
        "friction.coefficient": 0.0,
        "solver.reference.tolerance": 1e-13,
        "mechanism.guide_x": tip_x(scene()),
    }
    result = model.simulate(scene(rest | settings | changes))
    assert result.status == "success", result.remedy
    return result


def speed_after(result, contacts=2):
    end = result.events["end"][:contacts].max()
    return result.columns["slider_vx"][result.columns["time"] > end][0]


def rod_4_about_its_tip(data):
    """Moment of inertia of rod 4 with the slider about C, kg m^2."""
    rod4, slider = (data["mechanism"][name] for name in ("rod4", "slider"))
    return rod4["inertia"] + rod4["mass"] * rod4["centroid"] ** 2 + slider["mass"] * rod4["length"] ** 2


@pytest.mark.parametrize(("law", "contacts"), [("hertz-corners", 2), ("foundation", 1)])  # of a side
@pytest.mark.parametrize(
    ("damping_model", "values"),  # restitution for c_e = 0.9 and 0.1, docs/model.md
    [
        ("lankarani-nikravesh", (0.913, 0.665)),
        ("hunt-crossley", (0.909, 0.516)),
        ("flores", (0.894, 0.069)),
        ("gonthier", (0.876, 0.101)),
    ],
)
@pytest.mark.parametrize("solver", ["reference", "tree"])
def test_a_damping_model_gives_its_restitution(scene, solver, damping_model, values, law, contacts):
    """ln[(1 + C)/(1 - C e)] = C (1 + e), whatever mass, stiffness and exponent; a foundation's is 1."""
    for c_e, digits in zip((0.9, 0.1), values, strict=True):
        C = DAMPING[damping_model](c_e)
        highest = min(1.0, (1.0 - 1e-15) / C)  # there the logarithm's argument is infinite
        exact = brentq(lambda e, C=C: math.log((1.0 + C) / (1.0 - C * e)) - C * (1.0 + e), 0.01, highest)
        assert exact == pytest.approx(digits, abs=5e-4)
        changes = {"contact.law": law, "contact.damping_model": damping_model, "contact.restitution": c_e}
        result = on_the_wall(scene, solver, changes)
        assert speed_after(result, contacts) / SPEED == pytest.approx(exact, abs=1e-8)


def point_mass(data, mass, speed):
    """A hit by the page's law: rebound speed, duration, largest depth and force; flag of a pulling wall."""
    numbers = Numbers(data)

    def force(d, v):
        return numbers.point(numbers.K, d, v, 0.0, speed)[0][0]

    def out(_, state):
        return state[0]

    out.terminal, out.direction = True, -1
    solution = solve_ivp(
        lambda _, state: [state[1], -force(*state) / mass], (0.0, 1.0), [0.0, speed], method="DOP853",
        rtol=1e-12, atol=1e-16, events=out, first_step=1e-9, max_step=1e-6, dense_output=True,
    )  # fmt: skip
    turn = brentq(lambda t: solution.sol(t)[1], 0.0, solution.t[-1])
    forces = [force(*state) for state in solution.sol(np.linspace(0.0, solution.t[-1], 20001)[1:-1]).T]
    hit = -solution.y[1, -1], solution.t[-1], solution.sol(turn)[0], max(forces)
    return *hit, min(forces) == 0.0


# Changes of the contact, and a flag of a wall that would pull on the way out
HITS = {
    "elastic": ({"restitution": 1.0}, False),
    "adams, pulling": ({"stiffness": 1e9, "damping": 50.0, "damping_depth": 1e-6}, True),
    "adams, steeper": ({"stiffness": 4.6e9 * 5e-6**-0.7, "exponent": 2.2, "damping": 2600.0}, True),
}


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("hit", HITS)
def test_a_bounce_is_that_of_a_point_mass(scene, solver, hit):
    """Rod 4 is inclined by (1e-5 m)/(0.24 m) = 4e-5 at most: effects of second order are 2e-9."""
    law = {"law": "adams-impact"} if "adams" in hit else {}
    changes = {f"contact.{key}": value for key, value in (law | HITS[hit][0]).items()}
    data = scene(changes)
    # Two corners share the slider's effective mass
    mass = rod_4_about_its_tip(data) / data["mechanism"]["rod4"]["length"] ** 2 / 2.0
    rebound, duration, depth, peak, clipped = point_mass(data, mass, SPEED)
    if hit == "elastic":  # Hertz
        K = Numbers(data).K
        assert depth == pytest.approx((1.25 * mass * SPEED**2 / K) ** 0.4, rel=1e-9)
        # 3.2181 is printed with five digits
        assert duration == pytest.approx(3.2181 * (mass**2 / (K**2 * SPEED)) ** 0.2, rel=2e-5)
    result, error = on_the_wall(scene, solver, {"drive.cycles": 2e-14} | changes), SOLVERS[solver][2]
    events = result.events
    assert clipped == HITS[hit][1]
    assert list(events["corner"][:2]) == ["ll", "ul"]
    assert speed_after(result) / SPEED == pytest.approx(rebound / SPEED, abs=error)
    np.testing.assert_allclose(events["start"][:2], 1e-5 / SPEED, rtol=1e-8)
    values = [events["end"] - events["start"]]
    values += [events[key] for key in ("largest_depth", "impulse", "peak_force")]
    reference = [duration, depth, mass * (SPEED + rebound), peak]
    np.testing.assert_allclose(np.transpose(values)[:2], [reference] * 2, rtol=10 * error)


def test_the_default_damping_of_adams_impact_is_the_one_that_the_page_says(scene):
    """The damping is rounded to 10 N s/m, a 26th of the loss of 0.087."""
    rebound = point_mass(scene({"contact.law": "adams-impact"}), 0.0195, 0.07)[0]
    assert rebound / 0.07 == pytest.approx(0.913, abs=0.087 / 26)


def test_a_corner_s_hit_has_the_effective_mass_of_rod_and_slider(scene):
    """A frictionless hit by one corner: 1/m = L4^2/I + r_y^2/J5, rod 4 upright."""
    tilt, mechanism = 1e-3, scene()["mechanism"]
    changes = {"initial.slider_angle": tilt, "contact.restitution": 1.0, "clearance.slider": 2e-4}
    events = on_the_wall(scene, "reference", changes | {"drive.cycles": 1.2e-13}).events
    assert events["corner"][0] == "ul"
    assert not np.any(events["start"][1:] < events["end"][0])  # one corner alone
    slider, L4 = mechanism["slider"], mechanism["rod4"]["length"]
    ry = slider["length"] / 2 * math.cos(tilt) - slider["width"] / 2 * math.sin(tilt)
    mass = 1.0 / (L4**2 / rod_4_about_its_tip(scene()) + ry**2 / slider["inertia"])
    # An elastic hit returns twice the momentum of the effective mass. The slider turns by 4e-4 rad in it,
    # which moves r_y by 4e-4 * 25 mm, 3e-4 of it.
    assert events["impulse"][0] == pytest.approx(2.0 * mass * SPEED, rel=1e-3)
