"""The engine by itself, by laws of mechanics, and against the reference: both read one page of equations."""

import numpy as np
import pytest

pytest.importorskip("pinocchio", reason="pin has no wheel for this Python and platform, or is not installed")

from pinocchio_press.contact import CORNERS
from pinocchio_press.integration import integrate

import reference_model
from comparison.scene import load_scene
from comparison.tables.channels import channels, expected

pytestmark = pytest.mark.slow
ALL = {"output.groups": ["accelerations", "corners", "joints", "energy"]}
# Thrown into its guide with a spin: single hits, then both corners of a side.
THROW = ALL | {
    "drive.cycles": 0.08,
    "output.samples_per_cycle": 20_000,
    "initial.slider_omega": 1.0,
    "initial.slider_vx": 0.02,
}
# A workpiece that the slider meets in these runs.
LOAD = {"load.surface": 0.18, "load.force": 2.0}
MATERIALS = {"contact.youngs_modulus.slider": 69e9, "contact.poisson.guide": 0.3}
TABLE = {"load.surface": 0.18, "load.table": [[0.0, 0.0], [0.002, 5.0], [0.004, 1.0]]}


@pytest.mark.parametrize(
    "changes", [{}, {"contact.law": "foundation"}, {"contact.law": "adams-impact"}, LOAD, TABLE], ids=str
)
def test_energy_is_balanced_through_contacts(run, changes):
    _, result = run("150rpm-0.2mm", THROW | changes, 1e-12)
    assert len(result.events["start"]) > 3
    assert min(result.columns[f"energy_{loss}"][-1] for loss in ("damping", "friction")) > 1e-8
    # Measured at most 2e-11 J; a rate 1 % wrong at one corner would leave 1 % of the losses, above 1e-8 J.
    assert np.abs(result.columns["energy_residual"]).max() < 1e-10
    assert "load.surface" not in changes or result.columns["energy_load"].max() > 1e-3


def test_contacts_begin_and_end_where_the_gap_is_zero(run):
    _, result = run("150rpm-0.2mm", THROW, 1e-12)
    columns, events = result.columns, result.events
    assert min(events["normal_speed"].min(), events["impulse"].min()) > 0.0
    for name in CORNERS:
        gap, inside = columns[f"corner_{name}_gap"], np.zeros(len(columns["time"]), bool)
        for row in np.flatnonzero(events["corner"] == name):
            inside |= (columns["time"] > events["start"][row]) & (columns["time"] < events["end"][row])
        np.testing.assert_array_equal(gap < 0.0, inside)
        assert (columns[f"corner_{name}_normal"][~inside] == 0.0).all()


class Dip:
    """y = t, and a surface that is passed twice within a thousandth of a step."""

    def __init__(self):
        self.side, self.times = 1.0, []

    def rates(self, _t, _y):
        return np.ones(1)

    def surfaces(self, _t, y):
        return {("dip", 0): (self.side * ((y[0] - 0.53) ** 2 - 1e-8), self.side * 2.0 * (y[0] - 0.53))}

    def switch(self, _surface, t, _y):
        self.side *= -1.0
        self.times.append(t)


def test_a_dip_between_two_checks_is_found():
    system = Dip()
    pieces = list(integrate(system, np.zeros(1), 1.0, np.full(1, 1e-10), 1.0))
    # The square root of the rounding 1e-16 of the surface, over its slope of 2e-4.
    np.testing.assert_allclose(system.times, [0.5299, 0.5301], rtol=0, atol=1e-11)
    assert [piece.surface for piece in pieces if piece.surface] == [("dip", 0)] * 2
    assert [piece.end for piece in pieces[:-1]] == [piece.start for piece in pieces[1:]]


def reference_run(name, changes):
    result = reference_model.simulate(load_scene(name, changes | {"solver.reference.tolerance": 1e-12}).data)
    assert result.status == "success", result.remedy
    return result


def test_ideal_press_is_that_of_the_reference(run):
    changes = ALL | {"drive.cycles": 1.0}
    scene, result = run("ideal", changes)
    reference = reference_run("ideal", changes).columns
    assert set(result.columns) == {"time", *expected(scene)} == set(reference)
    # Measured: 4e-16 m, 4e-15 m/s, 7e-14 N, 7e-15 N m, 5e-15 J: all of it round-off.
    bounds = {"m": 1e-12, "rad": 1e-12, "m/s": 1e-12, "rad/s": 1e-12, "m/s^2": 1e-11, "rad/s^2": 1e-11}
    bounds |= {"N": 1e-11, "N m": 1e-10, "J": 1e-12}
    for name, channel in channels().items():
        if name in reference:
            assert np.abs(result.columns[name] - reference[name]).max() < bounds[channel.unit], name


# Bounds of instants (s): measured 1e-8 s, 9e-11 m at a touch with 1e-2 m/s; of the others 6e-8 and 3e-7 s, at
# a touch with 1e-4 m/s.
@pytest.mark.parametrize(
    ("name", "changes", "instants"),
    [
        ("150rpm-0.2mm", {"drive.cycles": 1.0}, 1e-7),
        ("surface", MATERIALS, 2e-6),
        ("150rpm-0.2mm", MATERIALS | {"drive.cycles": 0.3, "contact.law": "adams-impact"}, 2e-6),
    ],
)
def test_contacts_are_those_of_the_reference(run, name, changes, instants):
    """Over the whole run, chatter included: 104 contacts magnify the different round-off of both codes."""
    _, result = run(name, ALL | changes, 1e-12)
    other = reference_run(name, ALL | changes)
    difference = {key: np.abs(result.columns[key] - other.columns[key]) for key in result.columns}
    # Measured 1.8e-11 and 4.9e-12 m over the cycle, of the others 1.1e-10 and 1.4e-10 m.
    assert difference["slider_x"].max() < 1e-9
    if whole := changes == {"drive.cycles": 1.0}:
        # Measured 2.8e-12 m in y, 9e-11 m in a gap.
        for key in ("slider_y", *(f"corner_{corner}_gap" for corner in CORNERS)):
            assert difference[key].max() < 1e-9, key
        # Half the samples are before the chatter or between contacts: measured 1e-11 N m and 5e-10 N.
        assert np.median(difference["crank_torque"]) < 1e-10
        assert max(np.median(difference[f"reaction_{joint}_y"]) for joint in "OABHCF") < 1e-8
    # The same contacts of every corner, one by one; of all corners together two may touch at one instant.
    for corner in CORNERS:
        events, reference = (
            {
                column: source.events[column][source.events["corner"] == corner]
                for column in ("start", "impulse", "peak_force")
            }
            for source in (result, other)
        )
        assert len(events["start"]) == len(reference["start"])
        np.testing.assert_allclose(events["start"], reference["start"], rtol=0, atol=instants)
        # A table of steps holds the peaks of its steps only; the impulse is an integral.
        np.testing.assert_allclose(events["impulse"], reference["impulse"], rtol=1e-3, atol=1e-7)
        if whole:
            assert len(events["start"]) > 5
            np.testing.assert_allclose(events["peak_force"], reference["peak_force"], rtol=0.02, atol=1e-2)
