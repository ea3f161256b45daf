"""What holds along every motion: rates are derivatives, the energy is balanced."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

RATES = {"x": ("vx", "ax"), "y": ("vy", "ay"), "angle": ("omega", "alpha")}
AUDITED = pytest.mark.parametrize("variant", ["reference-minimal", "reference-multiplier", "exudyn-index2"])


def test_rates_are_the_derivatives(short):
    """Velocities sum up to positions, accelerations to velocities: radians, not degrees, and right limits."""
    for position, (rate, second) in RATES.items():
        for name, of in ((position, rate), (rate, second)):
            values, slopes = short.columns[f"slider_{name}"], short.columns[f"slider_{of}"]
            summed = cumulative_trapezoid(slopes, short.columns["time"], initial=0.0)
            # Fifty samples a hit: each is summed to some 1e-3 of itself. Angular velocities change by 2 rad/s
            # in it, of a range of that size; a motion knows nothing of hits but kinks in its rate.
            assert np.abs(values - values[0] - summed).max() <= 1e-3 * np.ptp(values), name


@AUDITED
@pytest.mark.parametrize("name", ["rattle", "wedge", "punch"])
def test_the_balance_of_energy_closes(run, variant, name):
    simulated = run(variant, name)
    parts = {key: simulated.columns[f"energy_{key}"] for key in ("drive", "gravity", "damping", "friction")}
    lost = parts["damping"] + parts["friction"]
    # Integrated with the motion at 1e-12; by the trapezoidal rule over steps of 2e-6 s through hits of
    # 1.5e-4 s, (1/75)^2 of what they take.
    assert lost[-1] > 1e-5
    residual = np.abs(simulated.columns["energy_residual"]).max()
    bound = (1e-8 if simulated.reference else 1e-3) * lost[-1]
    assert residual <= bound
    assert np.all(np.diff(parts["friction"]) >= 0.0)
    assert all(values[0] == 0.0 for values in parts.values())  # counted from t = 0
    for part in ("kinetic", "contact"):
        assert simulated.result.extrema[f"energy_{part}"]["min"] >= 0.0
        assert np.all(simulated.columns[f"energy_{part}"] >= 0.0)


@AUDITED
def test_a_cycle_of_the_ideal_mechanism_returns_all_work(run, variant):
    columns = run(variant, "turn").columns
    for name in ("drive", "gravity"):
        work = columns[f"energy_{name}"]
        assert np.ptp(work) > 0.5
        # The trapezoidal rule over a period is exact to round-off; the Newton iteration leaves 1e-12
        assert abs(work[-1]) < 1e-10
    kinetic = columns["energy_kinetic"]
    assert kinetic[-1] == pytest.approx(kinetic[0], rel=1e-9)
    # Within the cycle second order in Exudyn's step: 2e-8 J of 1 J measured
    assert np.max(np.abs(columns["energy_residual"])) < 4e-8
    for name in ("contact", "damping", "friction"):
        assert not columns[f"energy_{name}"].any()
