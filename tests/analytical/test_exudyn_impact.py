"""A hit by the law adams-impact: the slider of the Exudyn model against a point mass by scipy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from exudyn_model import simulate
from exudyn_model.linkage import driven_rod4, linkage_array
from exudyn_model.parameters import read_scene

SPEED, CLEARANCE = 0.03, 1e-5
K = 4 / (6 * (1 - 0.28**2) / 210e9) * 1e-3**0.5  # Eq. 10
TREE = {
    "solver.exudyn.formulation": "tree",
    "solver.exudyn.method": "dopri5",
    "solver.exudyn.step": 1e-4,
    "solver.exudyn.tolerance": 1e-13,
}
# Damping as chosen; hardly a bounce; one that would pull on the way out, with a stiffness of the scene's own
HITS = {
    "usual": {},
    "strong": {"contact.damping": 3e4},
    "clipped": {"contact.stiffness": 1e9, "contact.damping": 50.0, "contact.damping_depth": 1e-6},
}


def point_mass(mass, speed, contact):
    """One hit: restitution, duration, impulse, largest depth and force, and whether a wall would have pulled.

    The mass leaves a clipped contact where its depth is zero, as it does any other.
    """
    k, n = contact.get("stiffness") or K, contact["exponent"]

    def sum_of_forces(depth, rate):
        share = min(depth / contact["damping_depth"], 1.0)
        return k * max(depth, 0.0) ** n + contact["damping"] * (3 * share**2 - 2 * share**3) * rate

    def motion(_, state):
        depth, rate, _ = state
        force = max(sum_of_forces(depth, rate), 0.0) if depth > 0.0 else 0.0
        return [rate, -force / mass, force]

    def separation(_, state):
        return state[0]

    separation.terminal, separation.direction = True, -1
    solution = solve_ivp(
        motion, (0.0, 1.0), [0.0, speed, 0.0], method="DOP853", rtol=1e-12, atol=1e-16, events=separation,
        dense_output=True, first_step=1e-9, max_step=5e-7,
    )  # fmt: skip
    duration = solution.t[-1]
    depths, rates, _ = solution.sol(np.linspace(0.0, duration, 20001)[1:-1])
    sums = [sum_of_forces(*state) for state in zip(depths, rates, strict=True)]
    return -solution.y[1, -1] / speed, duration, solution.y[2, -1], depths.max(), max(sums), min(sums) < 0.0


def upright(scene, changes):
    """The press with its crank all but at rest and rod 4 upright, thrown at its left wall with both corners.

    Half of the effective mass, which is that of rod 4 with the slider about C, falls to each of the corners.
    """
    mechanism = read_scene(scene()).mechanism
    still = {
        "mechanism.guide_x": driven_rod4(0.0, linkage_array(mechanism))[0].x,
        "drive.speed_rpm": 1e-9,  # a period of 6e10 s
        "drive.cycles": 1e-13,  # 6 ms
        "output.samples_per_cycle": 10**16,
        "clearance.slider": CLEARANCE,
        "initial.slider_offset": 0.0,
        "initial.slider_vx": -SPEED,
        "environment.gravity": 0.0,
        "friction.coefficient": 0.0,
        "contact.law": "adams-impact",
    }
    rod4, slider = mechanism.rod4, mechanism.slider
    inertia = rod4.inertia + rod4.mass * rod4.centroid**2 + slider.mass * rod4.length**2
    data = scene(still | changes)
    return data, inertia / rod4.length**2 / 2


@pytest.mark.parametrize("hit", HITS)
def test_slider_hits_its_wall_like_a_point_mass(scene, hit):
    data, mass = upright(scene, TREE | HITS[hit])
    result = simulate(data)
    assert result.status == "success", result.remedy
    events, columns = result.events, result.columns
    restitution, duration, impulse, depth, peak, pulls = point_mass(mass, SPEED, data["contact"])
    assert pulls == (hit == "clipped")
    assert list(events["corner"][:2]) == ["ll", "ul"]
    # Rod 4 is inclined by (1e-5 m)/(0.24 m) = 4e-5: effects of second order are 2e-9
    for corner in range(2):
        assert events["start"][corner] == pytest.approx(CLEARANCE / SPEED, rel=1e-8)
        assert events["end"][corner] - events["start"][corner] == pytest.approx(duration, rel=1e-7)
        assert events["impulse"][corner] == pytest.approx(impulse, rel=1e-7)
        # A parabola of the depth, a scan of the force
        assert events["largest_depth"][corner] == pytest.approx(depth, rel=1e-6)
        assert events["peak_force"][corner] == pytest.approx(peak, rel=1e-4)
    after = columns["slider_vx"][columns["time"] > events["end"][:2].max()][0]
    assert after / SPEED == pytest.approx(restitution, abs=1e-7)


@pytest.mark.parametrize("hit", HITS)
def test_five_bodies_do_so_to_the_error_of_their_step(scene, hit):
    data, mass = upright(scene, HITS[hit] | {"solver.exudyn.step": 5e-7})
    result = simulate(data)
    assert result.status == "success", result.remedy
    columns, exact = result.columns, point_mass(mass, SPEED, data["contact"])[0]
    after = columns["slider_vx"][columns["time"] > result.events["end"][:2].max()][0]
    # Measured 2.9e-7, 6.8e-8 and 2.5e-8; four times the first one with a step of 1e-6 s
    assert after / SPEED == pytest.approx(exact, abs=1e-6)


def test_the_chosen_damping_gives_the_page_s_restitution(scene):
    """Of a hit of 0.0195 kg at 0.07 m/s, that of Eqs. 9-11, 0.9132; a damping of two digits gives 0.9140."""
    assert point_mass(0.0195, 0.07, scene()["contact"])[0] == pytest.approx(0.9132, abs=1e-3)
