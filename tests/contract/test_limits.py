"""Limits with a known answer: no clearance, no gravity."""

import math

import numpy as np
import pytest

CENTRED = {"mechanism.reference_offset": 0.0, "initial.slider_offset": 0.0}
STILL = {"drive.cycles": 0.001}


def test_small_clearance_tends_to_the_ideal_mechanism_at_first_order(run, variant) -> None:
    """A quarter of the clearance, a quarter of the deviation; y moves tan(beta) times as far as x."""
    # Through the largest tan(beta), 0.2093, with x at both walls.
    common = {**CENTRED, "drive.cycles": 0.2, "output.groups": []}
    ideal, deviations = run("reference-minimal", "ideal", common).columns, []
    for clearance in (4e-5, 1e-5):
        found = run(variant, "150rpm-0.2mm", {**common, "clearance.slider": clearance}).columns
        across, along = (np.abs(found[name] - ideal[name]).max() for name in ("slider_x", "slider_y"))
        # The walls give way by up to a micrometre or two.
        assert 0.99 * clearance <= across <= clearance + 2e-6
        assert along <= 0.2093 * 1.02 * across
        deviations.append(along)
    # Less the depth in the walls, which has no part in the limit: 1e-5 m leave room for a tenth of it.
    assert math.log(deviations[0] / deviations[1], 4.0) == pytest.approx(1.0, abs=0.1)


def test_gravity_enters_as_the_weight_of_rod_4_and_slider(run, variant) -> None:
    """Between the walls, from one state, a(g) - a(0) is that of a pendulum about C; alpha stays."""

    def first(gravity):
        found = run(variant, "150rpm-0.2mm", {"environment.gravity": gravity, **STILL})
        return {name: values[0] for name, values in found.columns.items()}, found.scene["mechanism"]

    still, mechanism = first(0.0)
    rod, slider = mechanism["rod4"], mechanism["slider"]
    moment = rod["mass"] * rod["centroid"] + slider["mass"] * rod["length"]
    inertia = rod["inertia"] + rod["mass"] * rod["centroid"] ** 2 + slider["mass"] * rod["length"] ** 2
    # beta, the inclination of rod 4, from the slider's accelerations themselves: it falls along its circle.
    for gravity in (9.81, -9.81):
        moved = first(gravity)[0]
        ax, ay = (moved[name] - still[name] for name in ("slider_ax", "slider_ay"))
        expected = -moment * gravity / inertia * rod["length"] * math.sin(math.atan2(ay, ax))
        # Accelerations of some 80 m/s^2, rounded at 1e-14 of them in each of two runs.
        assert math.hypot(ax, ay) == pytest.approx(abs(expected), rel=1e-9)
        assert moved["slider_alpha"] == still["slider_alpha"] == 0.0


@pytest.mark.parametrize("variant", ["reference-minimal", "reference-multiplier", "exudyn-index2"])
def test_without_gravity_nothing_weighs(run, variant) -> None:
    """Frame reactions at t = 0 differ by the weights of what they carry: in all, that of the mechanism."""
    without, found = (run(variant, "150rpm-0.2mm", {"environment.gravity": g, **STILL}) for g in (0.0, 9.81))
    assert not without.columns["energy_gravity"].any()
    assert found.columns["energy_gravity"].any()

    def more(name):
        return found.columns[name][0] - without.columns[name][0]

    # With the slider in free flight the frame bears all weights less m a of what falls.
    mechanism = found.scene["mechanism"]
    rod, slider = mechanism["rod4"], mechanism["slider"]
    weight = 9.81 * sum(mechanism[k]["mass"] for k in ("crank", "rod2", "rocker", "rod4", "slider"))
    falling = (slider["mass"] + rod["mass"] * rod["centroid"] / rod["length"]) * more("slider_ay")
    # Exudyn's initial multipliers are those of its own first iteration, 1e-6 of some 20 N.
    allowed = 1e-9 if found.reference else 5e-5
    assert more("reaction_O_y") + more("reaction_H_y") == pytest.approx(weight + falling, abs=allowed)
