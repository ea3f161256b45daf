"""Implausible values are warned of with the reason, and nothing that users usually do is."""

import numpy as np
import pytest

import reference_model
from comparison.scene import load_scene, shipped_scenes
from comparison.scene.loading import contact_time
from comparison.studies.trust.population import changed, scenes_with_clearance

PAPER = "150rpm-0.2mm"
FORMULATION, STEP = "solver.exudyn.formulation", "solver.exudyn.step"


@pytest.mark.parametrize(
    ("name", "changes", "words"),
    [
        (PAPER, {"initial.slider_offset": -3e-4}, "the slider starts inside the wall"),
        ("ideal", {"initial.slider_offset": -3e-4}, ""),  # which has none
        (PAPER, {"initial.slider_angle": 5.0}, "puts a corner 0.016 m inside the wall, deeper than"),
        (PAPER, {STEP: 2.5e-5}, "contacts of 0.00016 s require at most 2.1e-05 s"),
        (PAPER, {STEP: 2e-5}, ""),
        (PAPER, {STEP: 2e-5, "contact.youngs_modulus": 420e9}, "contacts of 0.00012 s"),
        ("crank-pin", {STEP: 1e-5}, "solver.exudyn.step = 1e-05 s is outside the asymptotic range"),
        (PAPER, {FORMULATION: "auto", STEP: 1e-3}, ""),
        ("ideal", {STEP: 1e-4}, ""),
        (PAPER, {"clearance.slider": 0.3}, "(width 0.05 m, length 0.07 m) turn over in its guide"),
        (
            PAPER,
            {"clearance.slider": 3e-3},
            "(width 0.05 m, length 0.07 m) tilt by 4.9 degrees in",
        ),
        (PAPER, {"clearance.slider": 1e-3}, ""),
        ("crank-pin", {"clearance.slider": 0.3}, ""),  # of an ideal slider
        ("crank-pin", {"clearance.crank_pin": 0.2}, "0.2 m is large for clearance.journal_radius = 0.01 m"),
        (PAPER, {"contact.corner_radius": 0.03}, "0.03 m is larger than half the slider (width 0.05 m"),
        (PAPER, {"contact.youngs_modulus": 210.0}, "210 Pa is softer than rubber"),
        (PAPER, {"contact.youngs_modulus.guide": 2.1e14}, "2.1e+14 Pa is stiffer than diamond"),
        (PAPER, {"friction.coefficient": 15.0}, "it is no percentage"),
        (PAPER, {"environment.gravity": 9810.0}, "9810 m/s^2 is more than ten times the Earth's"),
        # As Table 1 prints it; a counterweight on the other side is none.
        (PAPER, {"mechanism.crank.centroid": 0.225}, "is farther out than the rod's end, 0.045 m"),
        (PAPER, {"mechanism.crank.centroid": -0.01}, ""),
        (PAPER, {"load.force": 500.0, "load.surface": -31.8}, "-31.8 m is beyond the linkage, 1.365 m"),
        (PAPER, {"load.depth": 0.01}, "has no effect without load.force or load.table"),
        ("workpiece", {"load.depth": 3.0}, "3 m is as large as the linkage, 1.365 m"),
        ("workpiece", {"load.force": 0.0}, ""),
        (PAPER, {"contact.stiffness": 1e9}, "has no effect under contact.law = 'hertz-corners'"),
        (PAPER, {"contact.damping": 100.0}, "has no effect under contact.law = 'hertz-corners'"),
        (
            PAPER,
            {"contact.law": "adams-impact", "contact.restitution": 0.5},
            "contact.restitution = 0.5 has no effect under contact.law = 'adams-impact'",
        ),
        ("adams-impact", {"contact.damping": 100.0, "contact.corner_radius": 2e-3}, ""),
        ("adams-impact", {"contact.stiffness": 1e9}, ""),
        (
            "adams-impact",
            {"contact.stiffness": 1e9, "contact.youngs_modulus": 210.0},
            "effect beside contact.stiffness",
        ),
        (
            "crank-pin",
            {"contact.law": "adams-impact", "contact.stiffness": 1e9, "contact.youngs_modulus": 210.0},
            "contact.youngs_modulus = 210.0 has no effect",
        ),
        (
            PAPER,
            {"contact.law": "foundation", "contact.exponent": 1.2},
            "contact.exponent = 1.2 has no effect",
        ),
        ("crank-pin", {"contact.law": "foundation", "contact.exponent": 1.2}, ""),
        ("ideal", {"contact.restitution": 0.5, "contact.stiffness": 1e9}, ""),
        (
            "adams-impact",
            {"contact.stiffness": 1e15, STEP: 1e-6, FORMULATION: "full"},
            "contacts of 1.2e-06 s",
        ),
        (PAPER, {"mechanism.slider.inertia": 26.3}, "exceeds mass times size squared, 0.0013 kg m^2"),
    ],
)
def test_an_implausible_value_is_a_warning_with_its_reason(name, changes, words):
    warnings = load_scene(name, changes).warnings
    assert len(warnings) == bool(words), warnings
    assert words in "".join(warnings)
    if words:
        assert any(warnings[0].startswith(f"{key.removesuffix('.guide')} = ") for key in changes)


def test_no_shipped_scene_nor_its_usual_changes_are_warned_of():
    for name in shipped_scenes():
        assert load_scene(name).warnings == ()
    rng = np.random.default_rng(1)
    for name in scenes_with_clearance() * 40:
        scene = changed(load_scene(name), rng)
        # A clearance that is drawn may be smaller than the offset of the start.
        outside = abs(scene.data["initial"]["slider_offset"]) > scene.data["clearance"]["slider"]
        # And a key that is drawn may be one that the scene's law does not use.
        told = [line for line in scene.warnings if "has no effect under contact.law" not in line]
        assert len(told) <= outside, (scene.overrides, told)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"contact.exponent": 1.2},
        {"contact.corner_radius": 3e-3},
        {"contact.youngs_modulus.slider": 69e9, "drive.speed_rpm": 300.0},
        {"joints.slider": "ideal", "joints.crank_pin": "clearance"},
    ],
)
def test_the_contact_time_is_that_of_the_short_contacts_of_a_run(changes):
    """Half of it is below the shortest contact, the median of all is above it."""
    scene = load_scene(PAPER, {"drive.cycles": 0.3, "output.groups": []} | changes)
    events = reference_model.simulate(scene.data).events
    lengths = np.asarray(events["end"] - events["start"])[:-1]  # the last may be cut off
    assert 0.5 * lengths.min() < contact_time(scene.data) < np.median(lengths)


def test_numbers_at_the_ends_of_the_machine_are_no_internal_error():
    for key in ("drive.speed_rpm", "contact.exponent", "mechanism.rod4.length", "contact.corner_radius"):
        for value in (1e-30, 1.0, 1e30):
            if (key, value) != ("contact.exponent", 1e-30):
                assert load_scene("both-clearances", {key: value}).name
