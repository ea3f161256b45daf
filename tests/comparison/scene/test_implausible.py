"""Implausible values are warned of with the reason, and nothing that users usually do is."""

import numpy as np
import pytest

import reference_model
from comparison.scene import load_scene, shipped_scenes
from comparison.scene.loading import contact_time

PAPER = "150rpm-0.2mm"
STEP, LAW, STIFFNESS = "solver.exudyn.step", "contact.law", "contact.stiffness"
EXPONENT, MODULUS = "contact.exponent", "contact.youngs_modulus"


@pytest.mark.parametrize(
    ("name", "changes", "words"),
    [
        (PAPER, {"initial.slider_offset": -3e-4}, "the slider starts inside the wall"),
        (PAPER, {"initial.slider_angle": 5.0}, "puts a corner 0.016 m inside the wall, deeper than"),
        (PAPER, {STEP: 2.5e-5}, "contacts of 0.00016 s require at most 2.1e-05 s"),
        ("crank-pin", {STEP: 1e-5}, "solver.exudyn.step = 1e-05 s is outside the asymptotic range"),
        (PAPER, {"clearance.slider": 0.3}, "(width 0.05 m, length 0.07 m) turn over in its guide"),
        (PAPER, {"clearance.slider": 3e-3}, "(width 0.05 m, length 0.07 m) tilt by 4.9 degrees in"),
        ("crank-pin", {"clearance.crank_pin": 0.2}, "0.2 m is large for clearance.journal_radius = 0.01 m"),
        (PAPER, {"contact.corner_radius": 0.03}, "0.03 m is larger than half the slider (width 0.05 m"),
        (PAPER, {MODULUS: 210.0}, "210 Pa is softer than rubber"),
        (PAPER, {f"{MODULUS}.guide": 2.1e14}, "2.1e+14 Pa is stiffer than diamond"),
        (PAPER, {"friction.coefficient": 15.0}, "it is no percentage"),
        (PAPER, {"environment.gravity": 9810.0}, "9810 m/s^2 is more than ten times the Earth's"),
        # As Table 1 prints it
        (PAPER, {"mechanism.crank.centroid": 0.225}, "is farther out than the rod's end, 0.045 m"),
        (PAPER, {"mechanism.slider.inertia": 26.3}, "exceeds mass times size squared, 0.0013 kg m^2"),
        (PAPER, {"load.force": 500.0, "load.surface": -31.8}, "-31.8 m is beyond the linkage, 1.365 m"),
        (PAPER, {"load.depth": 0.01}, "has no effect without load.force or load.table"),
        ("workpiece", {"load.depth": 3.0}, "3 m is as large as the linkage, 1.365 m"),
        (PAPER, {STIFFNESS: 1e9}, "has no effect under contact.law = 'hertz-corners'"),
        (PAPER, {LAW: "adams-impact", STIFFNESS: 1e9, MODULUS: 210.0}, "effect beside contact.stiffness"),
        # Of an ideal slider, a tree's largest step, a counterweight, the journal's law
        ("ideal", {"initial.slider_offset": -3e-4, STIFFNESS: 1e9, STEP: 1e-4}, ""),
        ("crank-pin", {"clearance.slider": 0.3, LAW: "foundation", EXPONENT: 1.2}, ""),
        (PAPER, {"solver.exudyn.formulation": "auto", STEP: 1e-3, "mechanism.crank.centroid": -0.01}, ""),
        (PAPER, {STEP: 1.7e-5, "clearance.slider": 1e-3, "initial.slider_offset": 9e-4}, ""),
        ("adams-impact", {"contact.damping": 100.0, "contact.corner_radius": 2e-3}, ""),
    ],
)
def test_an_implausible_value_is_a_warning_with_its_reason(name, changes, words):
    warnings = load_scene(name, changes).warnings
    assert len(warnings) == bool(words), warnings
    assert words in "".join(warnings)
    if words:
        assert any(warnings[0].startswith(f"{key.removesuffix('.guide')} = ") for key in changes)


def test_no_shipped_scene_is_warned_of():
    assert not [load_scene(name).warnings for name in shipped_scenes() if load_scene(name).warnings]


def test_the_contact_time_is_that_of_the_short_contacts_of_a_run():
    """Half of it is below the shortest contact, the median of all is above it."""
    changes = {"drive.cycles": 0.3, "output.groups": [], EXPONENT: 1.2, f"{MODULUS}.slider": 69e9}
    scene = load_scene(PAPER, changes)
    events = reference_model.simulate(scene.data).events
    lengths = np.asarray(events["end"] - events["start"])[:-1]  # the last may be cut off
    assert 0.5 * lengths.min() < contact_time(scene) < np.median(lengths)
