"""Limits with a known answer: no clearance, no gravity."""

import math

import numpy as np
import pytest

CENTRED = {"mechanism.reference_offset": 0.0, "initial.slider_offset": 0.0}


def test_small_clearance_tends_to_the_ideal_mechanism_at_first_order(run, variant) -> None:
    """A quarter of the clearance, a quarter of the deviation; y moves tan(beta) times as far as x."""
    # Through the largest tan(beta), 0.2093, with x at both walls.
    common = {**CENTRED, "drive.cycles": 0.2, "output.groups": []}
    ideal = run("reference-minimal", "ideal", common).columns
    clearances, deviations = (4e-5, 1e-5), []
    for clearance in clearances:
        with_clearance = run(variant, "150rpm-0.2mm", {**common, "clearance.slider": clearance})
        across = np.abs(with_clearance.columns["slider_x"] - ideal["slider_x"]).max()
        along = np.abs(with_clearance.columns["slider_y"] - ideal["slider_y"]).max()
        # The walls give way by up to a micrometre or two.
        assert 0.99 * clearance <= across <= clearance + 2e-6
        assert along <= 0.2093 * 1.02 * across
        deviations.append(along)
    # Less the depth in the walls, which has no part in the limit: 1e-5 m leave room for a tenth of it.
    order = math.log(deviations[0] / deviations[1], clearances[0] / clearances[1])
    assert order == pytest.approx(1.0, abs=0.1)


def test_gravity_enters_as_the_weight_of_rod_4_and_slider(run, variant) -> None:
    """Between the walls, from one state, a(g) - a(0) is that of a pendulum about C; alpha stays."""
    gravity = 9.81
    first = {}
    for value in (0.0, gravity, -gravity):
        changes = {"environment.gravity": value, "drive.cycles": 0.001}
        first[value] = {k: v[0] for k, v in run(variant, "150rpm-0.2mm", changes).columns.items()}
    scene = run(variant, "150rpm-0.2mm", {"environment.gravity": 0.0, "drive.cycles": 0.001}).scene
    rod, slider = scene["mechanism"]["rod4"], scene["mechanism"]["slider"]
    moment = rod["mass"] * rod["centroid"] + slider["mass"] * rod["length"]
    inertia = rod["inertia"] + rod["mass"] * rod["centroid"] ** 2 + slider["mass"] * rod["length"] ** 2
    # beta, the inclination of rod 4, from the slider's accelerations themselves: it falls along its circle.
    for value in (gravity, -gravity):
        ax, ay = (first[value][f"slider_a{axis}"] - first[0.0][f"slider_a{axis}"] for axis in "xy")
        inclination = math.atan2(ay, ax)
        expected = -moment * value / inertia * rod["length"] * math.sin(inclination)
        # Accelerations of some 80 m/s^2, rounded at 1e-14 of them in each of two runs.
        assert math.hypot(ax, ay) == pytest.approx(abs(expected), rel=1e-9)
        assert first[value]["slider_alpha"] == first[0.0]["slider_alpha"] == 0.0


@pytest.mark.parametrize("variant", ["reference-minimal", "reference-multiplier", "exudyn-index2"])
def test_without_gravity_nothing_weighs(run, variant) -> None:
    """Frame reactions at t = 0 differ by the weights of what they carry: in all, that of the mechanism."""
    columns = {}
    for value in (0.0, 9.81):
        found = run(variant, "150rpm-0.2mm", {"environment.gravity": value, "drive.cycles": 0.001})
        columns[value] = found.columns
        assert np.any(found.columns["energy_gravity"] != 0.0) == (value != 0.0)
    # With the slider in free flight the frame bears all weights less m a of what falls.
    mechanism = found.scene["mechanism"]
    rod, slider = mechanism["rod4"], mechanism["slider"]
    weight = 9.81 * sum(mechanism[k]["mass"] for k in ("crank", "rod2", "rocker", "rod4", "slider"))
    frame = sum(columns[9.81][f"reaction_{k}_y"][0] - columns[0.0][f"reaction_{k}_y"][0] for k in "OH")
    fall = columns[9.81]["slider_ay"][0] - columns[0.0]["slider_ay"][0]
    falling = (slider["mass"] + rod["mass"] * rod["centroid"] / rod["length"]) * fall
    # Exudyn's initial multipliers are those of its own first iteration, 1e-6 of some 20 N.
    assert frame == pytest.approx(weight + falling, abs=1e-9 if found.reference else 5e-5)
