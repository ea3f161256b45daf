"""Invariants of every correct run: models check them, random presses keep them; the energy is balanced."""

import numpy as np
import pytest

CONTACT = {"open-depth", "pull", "driving-friction", "leaving-start", "start-gap", "overlap"}
CONSTRAINTS = {"constraint-position", "constraint-velocity"}
PAPER = "150rpm-0.2mm"


def test_each_run_is_checked(short_run):
    invariants = short_run.result.provenance["invariants"]
    formulation = short_run.scene["solver"]["reference" if short_run.reference else "exudyn"]["formulation"]
    expected = CONTACT | ({"energy"} if "energy" in short_run.variant.groups else set())
    assert set(invariants) == expected | (CONSTRAINTS if formulation in ("multiplier", "full") else set())
    for invariant in invariants.values():
        assert 0.0 <= invariant["value"] <= invariant["bound"]
        assert 0.0 <= invariant["time_s"] <= short_run.columns["time"][-1] * (1 + 1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_no_random_press_breaks_one(run, variant, seed):
    """Run 0.01 s from anywhere between the walls, or from 4 um inside of one, moving into it.

    A force that jumps, of the paper's law, has no potential and gives the slider any energy: it may
    fly at a speed that a fixed step does not follow, so that five bodies go without it.
    """
    rng = np.random.default_rng([seed, *variant.encode()])
    laws = ["hertz-corners", "foundation", "adams-impact", "paper-switching"]
    rpm = float(rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(1.0, 3.0))
    changes = {
        "drive.speed_rpm": rpm,
        "drive.cycles": 0.01 * abs(rpm) / 60,
        "output.samples_per_cycle": max(10, round(6e4 / abs(rpm))),
        "mechanism.crank_angle_deg": rng.uniform(0.0, 360.0),
        "initial.slider_offset": rng.uniform(-2.04e-4, 2.04e-4),
        "initial.slider_vx": rng.uniform(-0.3, 0.3),
        "joints.crank_pin": str(rng.choice(["ideal", "clearance"])) if "multi" not in variant else "ideal",
        "contact.law": str(rng.choice(laws if "minimal" in variant or "tree" in variant else laws[:3])),
        "contact.damping": 10.0 ** rng.uniform(0.0, 4.0),
        "contact.youngs_modulus": 10.0 ** rng.uniform(7.0, 11.3),
        "contact.restitution": rng.uniform(),
        "friction.coefficient": float(rng.choice([0.0, 0.15, 1.0])),
    }
    run(variant, PAPER, changes, failures=("newton-failed", "step-too-small", "chatter"))


@pytest.mark.parametrize("variant", ["reference-minimal", "reference-multiplier", "exudyn-index2"])
@pytest.mark.parametrize("name", ["rattle", "wedge", "punch"])
def test_the_balance_of_energy_closes(run, variant, name):
    simulation = run(variant, name)
    parts = {key: simulation.columns[f"energy_{key}"] for key in ("drive", "gravity", "damping", "friction")}
    loss = parts["damping"] + parts["friction"]
    # Integrated with the motion at 1e-12; by the trapezoidal rule over steps of 2e-6 s through hits of
    # 1.5e-4 s, (1/75)^2 of their losses.
    assert loss[-1] > 1e-5
    residual = np.abs(simulation.columns["energy_residual"]).max()
    bound = (1e-8 if simulation.reference else 1e-3) * loss[-1]
    assert residual <= bound
    assert np.all(np.diff(parts["friction"]) >= 0.0)
    assert all(values[0] == 0.0 for values in parts.values())  # counted from t = 0
    for part in ("kinetic", "contact"):
        assert simulation.result.extrema[f"energy_{part}"]["min"] >= 0.0
        assert np.all(simulation.columns[f"energy_{part}"] >= 0.0)
