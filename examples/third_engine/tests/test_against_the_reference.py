"""The engine against the reference model: what both read from one page of equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pinocchio", reason="pin has no wheel for this Python and platform, or is not installed")

import reference_model
from comparison.scene import load_scene
from comparison.tables.channels import channels, expected

pytestmark = pytest.mark.slow
Run = Callable[..., Any]
GROUPS = ["accelerations", "corners", "joints", "energy"]


def of_the_reference(name: str, changes: dict[str, Any]) -> Any:
    result = reference_model.simulate(load_scene(name, changes | {"solver.reference.tolerance": 1e-12}).data)
    assert result.status == "success", result.remedy
    return result


@pytest.mark.parametrize(
    ("name", "changes"),
    [("surface", {}), ("150rpm-0.2mm", {"drive.cycles": 0.3, "contact.impact_speed": "current"})],
)
def test_other_laws(run: Run, name: str, changes: dict[str, Any]) -> None:
    _, result = run(name, changes, 1e-12)
    other = of_the_reference(name, changes)
    # Measured 1.1e-10 and 1.4e-10 m; asked as above.
    assert np.abs(result.columns["slider_x"] - other.columns["slider_x"]).max() < 1e-9
    for corner in ("ll", "lr", "ul", "ur"):
        own, theirs = (contacts(of, corner) for of in (result, other))
        # Measured 6e-8 s and 3e-7 s, at a touch with 1e-4 m/s; impulses to 6e-7 of 1e-3 N s.
        np.testing.assert_allclose(own["start"], theirs["start"], rtol=0, atol=2e-6)
        np.testing.assert_allclose(own["impulse"], theirs["impulse"], rtol=1e-3, atol=1e-7)


def contacts(result: Any, corner: str) -> dict[str, Any]:
    events = result.events
    return {what: events[what][events["corner"] == corner] for what in events if what != "corner"}


def test_ideal_press(run: Run) -> None:
    changes = {"drive.cycles": 1.0, "output.groups": GROUPS}
    scene, result = run("ideal", changes)
    reference = of_the_reference("ideal", changes).columns
    assert set(result.columns) == {"time", *expected(scene)} == set(reference)
    # Measured: 4e-16 m, 4e-15 m/s, 7e-14 N, 7e-15 N m, 5e-15 J: all of it round-off.
    bounds = {"m": 1e-12, "rad": 1e-12, "m/s": 1e-12, "rad/s": 1e-12, "m/s^2": 1e-11, "rad/s^2": 1e-11}
    bounds |= {"N": 1e-11, "N m": 1e-10, "J": 1e-12}
    for name, channel in channels().items():
        if name in reference:
            assert np.abs(result.columns[name] - reference[name]).max() < bounds[channel.unit], name


@pytest.mark.parametrize("name", ["150rpm-0.2mm", "300rpm-0.2mm"])
def test_cycle_with_clearance(run: Run, name: str) -> None:
    """Over the whole cycle, chatter included: 104 contacts magnify what the two codes round differently."""
    changes = {"drive.cycles": 1.0, "output.groups": GROUPS}
    _, result = run(name, changes, 1e-12)
    other = of_the_reference(name, changes)
    difference = {key: np.abs(result.columns[key] - other.columns[key]) for key in result.columns}
    # Measured 1.8e-11 and 4.9e-12 m in x, 2.8e-12 m in y, 9e-11 m in a gap; asked 1e-9 m.
    for key, values in difference.items():
        if key in ("slider_x", "slider_y") or key.endswith("_gap"):
            assert values.max() < 1e-9, key
    # Half the samples are before the chatter or between contacts: measured 1e-11 N m and 5e-10 N.
    assert np.median(difference["crank_torque"]) < 1e-10
    for joint in "OABHCF":
        assert np.median(difference[f"reaction_{joint}_y"]) < 1e-8
    # The same contacts of every corner, one by one; of all corners together two may touch at one instant.
    for corner in ("ll", "lr", "ul", "ur"):
        own, theirs = (contacts(of, corner) for of in (result, other))
        assert len(own["start"]) == len(theirs["start"]) > 5
        # Measured 1e-8 s: 9e-11 m at a touch with 1e-2 m/s.
        np.testing.assert_allclose(own["start"], theirs["start"], rtol=0, atol=1e-7)
        # A table of steps holds the peaks of its steps only; the impulse is an integral.
        np.testing.assert_allclose(own["impulse"], theirs["impulse"], rtol=1e-3, atol=1e-7)
        np.testing.assert_allclose(own["peak_force"], theirs["peak_force"], rtol=0.02, atol=1e-2)
