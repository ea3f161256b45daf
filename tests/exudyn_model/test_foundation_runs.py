"""Runs with a guide on an elastic foundation, of trees and of five bodies."""

import numpy as np
import pytest

from exudyn_model import simulate

FOUNDATION = {"contact.law": "foundation"}
LOSSLESS = {"contact.restitution": 1.0, "friction.coefficient": 0.0}


@pytest.fixture(scope="module")
def exact(tree_scene):
    """The first 0.3 cycles of the paper's press by its tree, closely: seventeen contacts."""
    return simulate(tree_scene(1e-12, FOUNDATION | {"drive.cycles": 0.3}))


def test_tree_converges(tree_scene, exact, error):
    """Measured 3.6e-10, 3.4e-11, 3.9e-12 and 4.9e-13 m at 1e-7, ..., 1e-10."""
    errors = []
    for tolerance in (1e-7, 1e-10):
        run = simulate(tree_scene(tolerance, FOUNDATION | {"drive.cycles": 0.3}))
        assert run.status == "success"
        assert list(run.events["corner"]) == list(exact.events["corner"])
        errors.append(error(run, exact, "slider_x"))
    # Ten times what was measured: where steps fall scatters it
    assert errors[1] < 5e-12
    assert errors[0] < 4e-9


@pytest.mark.parametrize("method", ["generalized-alpha", "trapezoidal-index2"])
def test_five_bodies_approach_the_tree_at_second_order(make_scene, tree_scene, error, method):
    """The first 0.1 cycles: an impact of a whole side, of 9 us, and six of a part of one, of 50 to 120 us."""
    exact = simulate(tree_scene(1e-11, FOUNDATION | {"drive.cycles": 0.1}))
    steps = (5e-7, 2.5e-7, 1.25e-7)
    changes = FOUNDATION | {"drive.cycles": 0.1, "solver.exudyn.method": method}
    runs = [simulate(make_scene(changes | {"solver.exudyn.step": step})) for step in steps]
    errors = [error(run, exact, "slider_x") for run in runs]
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    # 1.93 measured with either method; the first impact lasts 18 of the largest steps
    assert order == pytest.approx(2.0, abs=0.2), errors
    assert list(runs[-1].events["corner"]) == list(exact.events["corner"])
    # 2.0e-7 m measured
    assert errors[-1] < 4e-7
    for name in ("normal_speed", "impulse", "peak_force", "largest_depth"):
        # Second order in the 70 steps of the first impact: 1e-3, magnified by those that follow
        np.testing.assert_allclose(runs[-1].events[name], exact.events[name], rtol=0.02, err_msg=name)


@pytest.mark.parametrize("step", [8e-6, 2e-6])
def test_five_bodies_finish_a_cycle_with_rests_on_a_side(make_scene, step):
    result = simulate(make_scene(FOUNDATION | {"drive.cycles": 1.0, "solver.exudyn.step": step}))
    assert result.status == "success", result.remedy
    assert len(result.columns["time"]) == 1001
    # What its joints, placed to 1e-16 m, let the iteration meet: 5e-17 m times 2.88e10 N/m
    assert result.provenance["settings"]["newton_tolerance"] == pytest.approx(1.44e-6, rel=1e-2)


def test_each_side_has_one_row_at_a_time_named_by_the_corner_that_touches_first(tree_scene):
    """Samples 1 us apart; both corners' touches by straight flight from the last sample before a row."""
    changes = FOUNDATION | {"drive.cycles": 0.1, "output.samples_per_cycle": 400_000}
    result = simulate(tree_scene(1e-10, changes))
    columns, events = result.columns, result.events
    interval = columns["time"][1]
    assert len(events["start"]) == 7
    names = set()
    for number, corner in enumerate(events["corner"]):
        start, end = events["start"][number], events["end"][number]
        before = int(start / interval)
        own, other = (
            columns[f"corner_{place}{corner[1]}_gap"] for place in (corner[0], "ul"[corner[0] == "u"])
        )
        touches = [
            gap[before] / (gap[before - 1] - gap[before]) * interval + before * interval
            for gap in (own, other)
        ]
        # A microsecond's acceleration of some 1e3 m/s^2, of touches faster than 1e-3 m/s
        assert touches[0] == pytest.approx(start, abs=1e-9)
        assert not touches[0] - 1e-9 > touches[1] > before * interval
        names.add(corner)
        inside = np.arange(before + 1, int(end / interval) + 1)
        assert np.all(np.minimum(own, other)[inside] < 0.0)
        side = sum(columns[f"corner_{place}{corner[1]}_normal"] for place in "lu")
        assert np.all(side[inside] > 0.0)
        assert side[before] == side[inside[-1] + 1] == 0.0
        # Nine samples of the shortest contact, its peak within half an interval: (pi / 18)^2 / 2
        assert np.max(side[inside]) == pytest.approx(events["peak_force"][number], rel=0.016)
        depth = -min(np.min(own[inside]), np.min(other[inside]))
        assert depth == pytest.approx(events["largest_depth"][number], rel=0.016)
        impulse = np.sum(side[inside]) * interval
        assert impulse == pytest.approx(events["impulse"][number], rel=0.01)
    assert len(names) == 3


@pytest.fixture(scope="module")
def standing(make_scene):
    """Function from a solver to the energy (J) of a slider between the walls of a press that stands still.

    For 0.05 s, at samples, from velocities and gaps alone: of the slider, of rod 4, which swings about C, and
    of the walls. At 1e-9 rpm C does no work that counts.
    """

    def run(solver):
        period, duration = 60 / 1e-9, 0.05
        changes = {
            "drive.speed_rpm": 1e-9,
            "drive.cycles": duration / period,
            "output.samples_per_cycle": round(1000 * period / duration),
            "environment.gravity": 0.0,
            "initial.slider_vx": 0.1,
            "initial.slider_omega": 1.0,
        }
        scene = make_scene(FOUNDATION | LOSSLESS | changes | {"solver.exudyn": solver})
        result = simulate(scene)
        assert result.status == "success"
        columns, slider, rod = result.columns, scene["mechanism"]["slider"], scene["mechanism"]["rod4"]
        squared = columns["slider_vx"] ** 2 + columns["slider_vy"] ** 2
        inertia = rod["inertia"] + rod["mass"] * rod["centroid"] ** 2
        energy = (slider["mass"] + inertia / rod["length"] ** 2) * squared / 2
        energy += slider["inertia"] * columns["slider_omega"] ** 2 / 2
        stored = np.zeros_like(energy)
        compliance = 2 * (1 - scene["contact"]["poisson"] ** 2) / scene["contact"]["youngs_modulus"]
        stiffness = (slider["thickness"] + slider["length"]) / (0.475 * compliance)
        for side in "lr":
            depths = np.sort([-columns[f"corner_{end}{side}_gap"] for end in "lu"], axis=0)
            shallow, deep = depths
            with np.errstate(divide="ignore", invalid="ignore"):
                part = stiffness * deep**3 / (6 * (deep - shallow))
            whole = stiffness * (deep**2 + deep * shallow + shallow**2) / 6
            stored += np.where(shallow > 0, whole, np.where(deep > 0, part, 0.0))
        return energy + stored, stored, result

    return run


def test_nothing_is_lost_between_the_walls_of_a_standing_press(standing):
    energy, stored, result = standing({"formulation": "tree", "tolerance": 1e-12})
    assert len(result.events["start"]) > 50
    assert np.max(stored) > 0.5 * energy[0]
    # 4e-9 measured: 56 contacts of some 100 steps, each within 1e-12 rad/s of some 0.1 rad/s
    assert np.max(abs(energy / energy[0] - 1)) < 1e-8


def test_five_bodies_lose_nothing_but_what_their_order_leaves(make_scene):
    changes = FOUNDATION | LOSSLESS | {"drive.cycles": 0.1, "output.groups": ["energy"]}
    changes |= {"solver.exudyn.method": "trapezoidal-index2"}
    residuals = []
    for step in (5e-7, 2.5e-7):
        result = simulate(make_scene(changes | {"solver.exudyn.step": step}))
        assert result.status == "success"
        assert not result.columns["energy_friction"].any()
        # Sums of forces less the same: round-off
        assert np.max(np.abs(result.columns["energy_damping"])) < 1e-15
        residuals.append(result.provenance["invariants"]["energy"]["value"])
    # Measured 6.6e-6 and 1.6e-6 of the kinetic energy, within the impact of a whole side
    assert residuals[0] / residuals[1] == pytest.approx(4.0, abs=0.5)
    assert residuals[1] < 4e-6


def test_five_bodies_dissipate_what_damping_and_friction_take(make_scene):
    """Losses in either corner of a side, the one that is outside, too: else the audit would not close."""
    changes = FOUNDATION | {"drive.cycles": 0.1, "output.groups": ["corners", "energy"]}
    changes |= {"solver.exudyn.method": "trapezoidal-index2", "solver.exudyn.step": 2.5e-7}
    columns = simulate(make_scene(changes)).columns
    for name in ("damping", "friction"):
        assert np.all(np.diff(columns[f"energy_{name}"]) >= 0)
        assert columns[f"energy_{name}"][-1] > 5e-5
    # 5e-8 J measured at samples, of 8e-5 J and more that are lost
    assert np.max(np.abs(columns["energy_residual"])) < 2e-7
