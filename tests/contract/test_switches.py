"""Contacts that switch within rounding, loads that jump: each model gets through, and they agree."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest

import exudyn_model
import reference_model
from comparison.scene import load_scene

FOUNDATION = {"contact.law": "foundation", "contact.youngs_modulus": 5e9, "drive.cycles": 0.01}
FOUR_TIMES = {"length": 4, "centroid": 4, "width": 4, "thickness": 4, "mass": 32, "inertia": 512}
MECHANISM = load_scene("150rpm-0.2mm").data["mechanism"]
PULL = {
    f"mechanism.{body}.{key}": factor * MECHANISM[body][key]
    for body in ("crank", "rod2", "rocker", "rod4", "slider")
    for key, factor in FOUR_TIMES.items()
    if key in MECHANISM[body]
} | {
    "drive.speed_rpm": 643.2801978187919,
    "drive.cycles": 0.12,
    "clearance.slider": 6.28941107079976e-05,
    "contact.law": "foundation",
    "contact.youngs_modulus": 1057184133683.4039,
    "contact.restitution": 0.46708832100488973,
    "contact.corner_radius": 0.004,
    "contact.impact_speed_floor": 0.0008,
    "friction.coefficient": 0.25201925236368156,
    "friction.static_speed": 0.0008,
    "friction.transition_speed": 0.08,
    "initial.slider_offset": -3.797161909949002e-05,
    "initial.slider_angle": -1.3058089057062055e-06,
    "initial.slider_vx": 0.18814732206870055,
    "mechanism.crank_angle_deg": 287.45373255926864,
    "mechanism.rocker_pivot": [1.0272, 0.8],
    "mechanism.guide_x": -2.2,
    "mechanism.reference_offset": 1.164056763205344e-05,
    "mechanism.rod4.centroid": 0.32,
    "mechanism.rod4.mass": 3.1530708360752797,
    "mechanism.slider.inertia": 0.060254754105172344,
    "environment.gravity": -156.96,
}


def simulate(model, name, tolerance, changes):
    settings = {f"solver.{key}.tolerance": tolerance for key in ("reference", "exudyn")}
    settings |= {"solver.exudyn.formulation": "tree", "output.groups": []}
    result = model.simulate(load_scene(name, changes | settings).data)
    assert result.status == "success", result.remedy
    return result


reference, tree = partial(simulate, reference_model), partial(simulate, exudyn_model)


@pytest.mark.parametrize("law", ["foundation", "hertz-corners"])
# The gap at t = 0 rounds to 0, above it and below it.
@pytest.mark.parametrize(
    ("clearance", "guide", "spin"),
    [(2e-4, -0.55, 20.0), (2.4e-4, -0.5496528057142475, -20.0), (4.03e-4, -0.5519940396659647, 20.0)],
)
@pytest.mark.parametrize("wall", [1, -1])
def test_a_corner_that_starts_on_its_wall_has_its_own_speed(run, variant, law, clearance, guide, wall, spin):
    """The other corner of the side leaves the wall; (0.05 + 20 * 0.035) m/s."""
    changes = {
        "clearance.slider": clearance,
        "mechanism.guide_x": guide,
        "initial.slider_offset": wall * clearance,
        "initial.slider_omega": spin,
        "initial.slider_vx": wall * 0.05,
    }
    result = run(variant, "150rpm-0.2mm", FOUNDATION | changes | {"contact.law": law, "drive.cycles": 0.001})
    touching = ("u" if wall * spin < 0.0 else "l") + ("r" if wall > 0 else "l")
    first = result.contacts(touching)[0]
    # A gap of 1e-16 m, by rounding, is passed in 1e-16 s; five bodies interpolate the speed within a step.
    assert first["start"] == pytest.approx(0.0, abs=1e-14)
    assert first["normal_speed"] == pytest.approx(0.75, rel=1e-6)


@pytest.mark.parametrize(("wall", "spin"), [(1, -1.0), (-1, -1.0)])
def test_of_two_corners_that_touch_at_once_the_faster_has_the_side_s_speed(run, variant, wall, spin):
    """Corners at 0.05 -+ 0.035 m/s, on their wall at t = 0."""
    changes = {
        "initial.slider_offset": wall * 2e-4,
        "initial.slider_omega": spin,
        "initial.slider_vx": wall * 0.05,
    }
    result = run(variant, "150rpm-0.2mm", FOUNDATION | changes)
    # Its one contact, of whichever corner.
    assert result.result.events["start"][0] == pytest.approx(0.0, abs=1e-14)
    assert result.result.events["normal_speed"][0] == pytest.approx(0.085, rel=1e-6)


def test_friction_without_a_static_speed():
    """A slip that turns goes from ramp to ramp; the motion magnifies errors by decades."""
    changes = {"friction.static_speed": 0.0}
    exact = reference("90rpm-0.5mm", 1e-13, changes)
    for tolerance in (1e-8, 1e-10, 1e-12):
        reference("90rpm-0.5mm", tolerance, changes)
    other = tree("90rpm-0.5mm", 1e-11, changes)
    # Measured 1.9e-8 m, and 2.3e-8 m between the reference's own runs at 1e-12 and 1e-13.
    assert np.abs(other.columns["slider_x"] - exact.columns["slider_x"]).max() < 1e-7
    # A range narrower than the location of slips is as good as none.
    narrow = reference("90rpm-0.5mm", 1e-13, {"friction.static_speed": 1e-14})
    np.testing.assert_array_equal(narrow.columns["slider_x"], exact.columns["slider_x"])


@pytest.mark.parametrize("formulation", ["minimal", "multiplier"])
def test_a_side_hardly_inside_its_wall_stops_pulling_once(formulation):
    """Where the depths are small their rounding moves the resultant's point: the pull's zero is not sharp.

    The more so in a large press.
    """
    changes = PULL | {"solver.reference.formulation": formulation}
    exact = reference("150rpm-0.2mm", 1e-12, changes)
    for tolerance in (1e-8, 1e-9, 1e-10):
        counters = reference("150rpm-0.2mm", tolerance, changes).provenance["counters"]
        # 1089 steps and 69 switches are the most measured; the stall took 37435, and chatter 100 at once.
        assert counters["steps"] < 3000
        assert counters["switches"] < 200
    other = tree("150rpm-0.2mm", 1e-11, changes)
    # Measured 3e-12 m: gaps round at 4e-16 m.
    assert np.abs(other.columns["slider_x"] - exact.columns["slider_x"]).max() < 1e-10


CASES = Path(__file__).parents[1] / "cases" / "physics"
SURFACE = -0.0318
TABLES = {
    "jump": [[0.0, 0.0], [1e-30, 100.0]],
    "there and back": [[0.0, 0.0], [1e-18, 300.0], [1e-3, 100.0], [1e-3 + 1e-15, 0.1], [2e-3, 0.3]],
    "spike": [[0.0, 0.0], [1e-3, 100.0], [1.000001e-3, 5000.0], [1.000002e-3, 100.0]],
}
TIGHT = {
    "solver.reference.tolerance": 1e-12,
    "solver.exudyn.formulation": "tree",
    "solver.exudyn.tolerance": 1e-12,
}
FREE = {
    "mechanism.crank_angle_deg": 285.0, "drive.cycles": 0.07, "load.surface": SURFACE,
    "clearance.slider": 2e-2, "initial.slider_offset": 0.0, "output.samples_per_cycle": 500,
}  # fmt: skip


@pytest.mark.parametrize(
    ("rows", "contacts"), [*((rows, False) for rows in TABLES), ("jump", True), ("there and back", True)]
)
def test_both_models_move_alike_into_the_workpiece_and_out_of_it(rows, contacts):
    """A free flight magnifies nothing; with twenty contacts after it 6e-11 m are measured."""
    scene = CASES / "load-step.toml" if contacts else "150rpm-0.2mm"
    data = load_scene(scene, TIGHT | ({} if contacts else FREE) | {"load.table": TABLES[rows]}).data
    one, other = (model.simulate(data) for model in (reference_model, exudyn_model))
    assert one.status == other.status == "success"
    # Two corners that touch at one instant may stand in either order
    assert sorted(one.events["corner"]) == sorted(other.events["corner"])
    assert (len(one.events["corner"]) > 0) == contacts
    for name in ("slider_x", "slider_y"):
        assert np.abs(one.columns[name] - other.columns[name]).max() < 1e-9
    assert contacts or one.columns["slider_y"].min() < SURFACE - 1e-3
