"""`contact.impact_speed = "current"`: damping that refers to the present depth rate, without memory."""

import numpy as np
import pytest

from reference_model import simulate
from reference_model.parameters import read_parameters

CURRENT = {"contact.impact_speed": "current"}
SHORT = {"drive.cycles": 0.3, "solver.reference.tolerance": 1e-10}
LAWS = ("hertz-corners", "foundation")


def rates(result, corner):
    """Depth and its rate of a corner of the slider, from its motion."""
    sx, sy = (-0.025 if "l" in corner[1] else 0.025), (-0.035 if corner[0] == "l" else 0.035)
    angle, spin = result.columns["slider_angle"], result.columns["slider_omega"]
    ry = sx * np.sin(angle) + sy * np.cos(angle)
    inward = 1.0 if sx < 0.0 else -1.0
    return -result.columns[f"corner_{corner}_gap"], -inward * (result.columns["slider_vx"] - spin * ry)


@pytest.mark.parametrize("law", ["hertz-corners", "foundation"])
def test_the_force_in_a_table_has_this_factor(scene, law) -> None:
    """From gaps, motion and the scene's numbers alone; depths of 1e-6 m of gaps rounded at 1e-16 m."""
    changes = {**SHORT, **CURRENT, "contact.law": law, "output.samples_per_cycle": 100_000}
    data = scene(changes)
    result, c = simulate(data), read_parameters(data).law
    seen = 0
    for lower, upper in (("ll", "ul"), ("lr", "ur")):
        (d1, r1), (d2, r2) = rates(result, lower), rates(result, upper)
        normal = [result.columns[f"corner_{corner}_normal"] for corner in (lower, upper)]
        if law == "hertz-corners":
            for depth, rate, force in ((d1, r1, normal[0]), (d2, r2, normal[1])):
                inside = depth > 1e-9
                expected = (
                    c.K * depth[inside] ** 1.5 * (1.0 + c.C * rate[inside] / np.hypot(rate[inside], 1e-4))
                )
                # A rounding of the rate, 1e-15 m/s, over the floor; of the depth over 1e-9 m.
                np.testing.assert_allclose(force[inside], expected, rtol=1e-6)
                seen += inside.sum()
            continue
        inside = np.maximum(d1, d2) > 1e-9
        n1, n2 = normal[0][inside], normal[1][inside]
        rate = (n1 * r1[inside] + n2 * r2[inside]) / (n1 + n2)
        d1, d2 = np.maximum(d1, d2)[inside], np.minimum(d1, d2)[inside]
        elastic = 0.5 * c.Ks * np.where(d2 > 0.0, d1 + d2, d1**2 / (d1 - d2))
        expected = elastic * (1.0 + c.C * rate / np.hypot(rate, 1e-4))
        np.testing.assert_allclose(n1 + n2, expected, rtol=1e-6)
        seen += inside.sum()
    assert seen > 100


@pytest.mark.parametrize("law", LAWS)
def test_without_loss_there_is_no_difference(scene, law) -> None:
    """Restitution 1: C = 0, and the impact speed is in no formula."""
    elastic = {
        **SHORT,
        "contact.law": law,
        "contact.restitution": 1.0,
        "output.groups": ["energy", "corners"],
    }
    frozen, current = simulate(scene(elastic)), simulate(scene({**elastic, **CURRENT}))
    assert frozen.events["start"].size > 3
    for name, values in frozen.columns.items():
        np.testing.assert_array_equal(current.columns[name], values, err_msg=name)
    for name, values in frozen.events.items():
        if name in ("peak_force", "largest_depth"):  # searched for within a step in two ways; moves nothing
            np.testing.assert_allclose(current.events[name], values, rtol=1e-6)
        else:
            np.testing.assert_array_equal(current.events[name], values, err_msg=name)


@pytest.mark.parametrize("law", LAWS)
def test_energy_is_lost_and_accounted_for(scene, law) -> None:
    changes = {**SHORT, **CURRENT, "contact.law": law, "output.groups": ["energy", "corners"]}
    result = simulate(scene(changes))
    assert result.status == "success"
    assert np.abs(result.columns["energy_residual"]).max() < 1e-9
    damping = result.columns["energy_damping"]
    assert damping[-1] > 1e-5
    assert np.all(np.diff(damping) >= -1e-15)  # a loss at every depth rate, in and out
    # Nothing is ever clipped: a corner that is inside has a force.
    for corner in ("ll", "lr", "ul", "ur"):
        inside = result.columns[f"corner_{corner}_gap"] < -1e-9
        assert np.all(result.columns[f"corner_{corner}_normal"][inside] > 0.0)


def test_the_event_table_keeps_the_speed_of_the_touch(scene) -> None:
    """Up to the first contact nothing differs, and its row has the same speed."""
    frozen, current = simulate(scene(SHORT)), simulate(scene({**SHORT, **CURRENT}))
    for name in ("corner", "start", "normal_speed"):
        assert frozen.events[name][0] == current.events[name][0]
    # A constant share C of the spring's force takes more than C d'/v, which fades with the speed.
    assert current.events["end"][0] != frozen.events["end"][0]
    assert frozen.events["impulse"][0] != current.events["impulse"][0]


def test_peaks_of_the_force_are_found(scene) -> None:
    """Where the factor falls from 1 + C to 1 - C within the floor's 1e-4 m/s, at the greatest depth."""
    dense = {**SHORT, **CURRENT, "drive.cycles": 0.1, "output.samples_per_cycle": 2_000_000}
    for law in ("hertz-corners", "foundation"):
        result = simulate(scene({**dense, "contact.law": law}))
        events, time = result.events, result.columns["time"]
        for corner, begun, end, peak in zip(
            *(events[k] for k in ("corner", "start", "end", "peak_force")), strict=True
        ):
            side = [corner] if law == "hertz-corners" else [f"{row}{corner[1]}" for row in "lu"]
            during = (time >= begun) & (time <= end)
            force = sum(result.columns[f"corner_{name}_normal"][during] for name in side)
            # Samples are 2e-7 s apart, in which some m/s^2 1e3 change the rate by twice the floor: 1 %.
            assert force.max() <= peak * (1.0 + 1e-6)
            assert force.max() >= 0.98 * peak


def test_a_press_with_both_clearances_keeps_its_balance(scene) -> None:
    changes = {**CURRENT, "joints.crank_pin": "clearance", "drive.cycles": 0.1, "output.groups": ["energy"]}
    result = simulate(scene(changes))
    assert result.status == "success"
    assert "pin" in result.events["corner"]
    assert np.abs(result.columns["energy_residual"]).max() < 1e-7


def test_an_unknown_word_is_refused_in_one_line(scene) -> None:
    with pytest.raises(ValueError, match=r"contact\.impact_speed = 'old' is not simulated") as caught:
        simulate(scene({"contact.impact_speed": "old"}))
    assert "\n" not in str(caught.value)
