"""The paper's formulation as `numerics` has it: motions in closed form, and what its settings change."""

import numpy as np
import pytest
from scipy.optimize import brentq

from comparison.scene import load_scene
from comparison.studies.paper import numerics
from comparison.studies.paper.numerics import Setting

TIGHT = Setting(1e-10, 1e-12, 0.0, inside=False)
STILL = {"environment.gravity": 0.0, "drive.speed_rpm": 1e-9, "friction.coefficient": 0.0}


def moving(**values):
    """The press without gravity and friction, its crank at rest: rod 4 swings about a fixed end."""
    start = {f"initial.slider_{key}": value for key, value in values.items()}
    return numerics.press(load_scene("150rpm-0.2mm", STILL | start))


@pytest.mark.parametrize("restitution", [0.9, 0.5])
@pytest.mark.parametrize("inside", [False, True])
def test_a_bounce_returns_the_speed_of_the_law(restitution, inside):
    """ln((1 + C) / (1 - C e)) = C (1 + e) of any mass, stiffness and exponent; both corners hit at once."""
    damping = 0.75 * (1 - restitution**2)
    exact = brentq(lambda e: np.log((1 + damping) / (1 - damping * e)) - damping * (1 + e), 0.1, 1.0)
    values = {"initial.slider_offset": 1.9e-4, "initial.slider_vx": 0.05, "contact.restitution": restitution}
    scene = load_scene("150rpm-0.2mm", STILL | values)
    # The memory is the speed at the last step outside, or of the first inside: steps of 1 us at 0.05 m/s.
    setting = TIGHT._replace(relative=1e-9, absolute=1e-11, inside=inside)
    _, run = numerics.integrate(numerics.press(scene), setting, np.linspace(0.0, 1.5e-3, 200)[1:])
    # The slider's own speed falls by 1e-3 of itself while rod 4 turns, as for free flight.
    assert -run[2, -1] / 0.05 == pytest.approx(exact, rel=2e-3)


@pytest.mark.parametrize("gain", [0.0, 5.0, 100.0])
def test_a_violated_constraint_drifts_without_baumgarte_and_decays_with_it(gain):
    """Phi'' + 2 a Phi' + a^2 Phi = 0 of each row: Phi (1 + a t) exp(-a t) from a violation at rest."""
    p = moving(offset=0.0)
    state = numerics.initial_state(p)
    state[9] += 1e-6  # rod 4 is off both of its joints
    phi, _, rate, _ = numerics.constraints(p, 0.0, state[:15], state[15:])
    step, time = 1e-4, 0.02

    def rates(t, y):
        return numerics.derivative(p, t, y[:, None], gain, np.ones(4), False)[:, 0]

    for k in range(round(time / step)):  # classical Runge-Kutta: (100 * 1e-4)^4 / 120 of the violation a step
        t = k * step
        a = rates(t, state)
        b = rates(t + step / 2, state + step / 2 * a)
        c = rates(t + step / 2, state + step / 2 * b)
        state = state + step / 6 * (a + 2 * b + 2 * c + rates(t + step, state + step * c))
    left = numerics.constraints(p, time, state[:15], state[15:])[0]
    exact = (phi + (gain * phi + rate) * time) * np.exp(-gain * time)
    assert np.abs(phi[:13]).max() == pytest.approx(1e-6)
    assert left[:13] == pytest.approx(exact[:13], abs=1e-12)


def test_bounds_that_geometry_sets():
    """The slope of y in x times the way to the far wall; of the pin the figure of a second program."""
    scene = load_scene("150rpm-0.2mm")
    p = numerics.press(scene)
    middle = p.lines[1] - 1.25e-4  # between the ideal line and where the slider lies at the far wall
    times = np.linspace(0.0, scene.period, 721)
    angles = np.array([numerics.closure(p, t, middle, np.zeros(2))[11] for t in times])
    # y = C_y + L4 sin(theta_4): its slope in x is -1 / tan(theta_4).
    assert numerics.bound("150rpm-0.2mm") == pytest.approx(
        2.5e-4 * np.abs(1 / np.tan(angles)).max(), rel=1e-4
    )
    assert numerics.bound("crank-pin") == pytest.approx(5.668e-4, rel=1e-4)  # by a second program
