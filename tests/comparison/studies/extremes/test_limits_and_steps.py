"""Limits with a known answer, and limits of steps: theory against brute force, and runs of the reference."""

import cmath
import math
import re

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import DOP853

from comparison.execution.run import Outcome, run_one
from comparison.studies.extremes import study
from comparison.studies.extremes.cells import COLUMNS
from comparison.studies.extremes.limits import BOTH, LIMITS, NO_DAMPING, NO_FRICTION, TIGHT, TILTS, WIDE
from comparison.studies.extremes.steps import (
    FIXED,
    FULL,
    gain_scene,
    rebounds,
    run_impacts,
    run_steps,
    stable_to,
)

FEW = {
    "gains": (0.0, 10.0, 1e3), "tolerances": (5e-6, 1e-7), "cycles": (1.0, 2.0), "moduli": (1e9, 1e12),
    "impact_steps": (1e-6, 1e-5), "phases": (0.375,), "map_steps": (1e-5, 1e-4),
}  # fmt: skip

NUMBERS = ("error_m", "bound_m", "estimate_m", "magnification", "speed_rpm", "modulus_Pa")

# ---- limits


@pytest.fixture(scope="module")
def frames():
    """Runs of all limits by the reference; Exudyn's are said to have crashed."""
    return {
        name: limit.rows(
            [
                Outcome("success", table=run_one(job.scene, "reference"))
                if job.model == "reference"
                else Outcome("crashed")
                for job in limit.jobs
            ]
        )
        for name, limit in LIMITS.items()
    }


@pytest.mark.parametrize(
    ("name", "case", "quantity", "order", "slack"),
    [
        # The depth is a tenth of the smallest clearance of these: it takes some hundredths from the order.
        ("clearance", WIDE, "x", 1.0, 0.05),
        ("clearance", WIDE, "y", 1.0, 0.05),
        ("clearance", WIDE, "vx", 0.5, 0.1),
        ("clearance", TIGHT, "x", 0.0, 0.3),
        *(("stiffness", corners, "depth", -0.4, 0.005) for corners in TILTS),
        *(("stiffness", corners, "duration", -0.4, 0.005) for corners in TILTS),
        *(("stiffness", corners, "error", -0.4, 0.01) for corners in TILTS),
        *(("stiffness", corners, "x 1 in flight", -0.4, 0.02) for corners in TILTS),
        ("lossless", BOTH, "residual", 0.8, 0.3),
        *(("speed", 0.0, name, 2.0, 0.02) for name in ("wall force", "torque", "kinetic energy")),
        # At 60 rpm the force differs from the static one by half of it: the depth, its power 2/3, is not
        # linear.
        ("speed", 0.0, "depth", 2.0, 0.05),
    ],
)
def test_the_reference_converges_to_known_limits_at_known_orders(frames, name, case, quantity, order, slack):
    observed = LIMITS[name].observed(frames[name]).set_index(["case", "quantity"])
    assert np.isnan(observed["exudyn"][case, quantity])
    assert observed["reference"][case, quantity] == pytest.approx(order, abs=slack)


def test_the_limits_themselves(frames):
    ran = {name: frame[frame["model"] == "reference"] for name, frame in frames.items()}
    assert (ran["clearance"]["y"] <= 0.2095 * 1.001 * ran["clearance"]["x"]).all()
    stiffest = ran["stiffness"][ran["stiffness"]["modulus"] == 1e15]
    assert stiffest["restitution"].to_numpy() == pytest.approx(0.9131766778, abs=1e-3)
    assert stiffest["depth"].to_numpy() == pytest.approx(stiffest["point mass"].to_numpy(), rel=3e-4)
    lossless = ran["lossless"]
    assert ((lossless["damping"] > 0.0) == (lossless["case"] == NO_FRICTION)).all()
    assert ((lossless["friction"] > 0.0) == (lossless["case"] == NO_DAMPING)).all()
    rough = ran["speed"].loc[ran["speed"]["friction"] > 0, "torque"].to_numpy()
    assert rough[-1] == pytest.approx(rough[-2], rel=0.05)  # what does not vanish


# ---- steps


def after(steps, z):
    """Return |y| after so many steps of DOP853 on y' = z y, h = 1, stage by stage."""
    y = 1.0 + 0.0j
    for _ in range(steps):
        slopes = []
        for row in DOP853.A:
            slopes.append(z * (y + sum(a * k for a, k in zip(row, slopes, strict=False))))
        y += sum(b * k for b, k in zip(DOP853.B, slopes, strict=True))
    return abs(y)


@pytest.mark.parametrize("degrees", [180.0, 120.0, 90.0])
def test_the_stability_limit_of_dop853_parts_decay_from_growth(degrees):
    direction = cmath.exp(1j * math.radians(degrees))
    S = stable_to(direction)
    assert after(400, 0.99 * S * direction) < 1.0
    assert after(400, 1.01 * S * direction) > 2.0


def test_the_reference_takes_the_steps_that_stability_allows():
    """Loose tolerance, stiff error equation: the error control has nothing else to follow."""
    alpha = FULL["gains"][-1]
    scene = gain_scene("ideal slider", alpha, alpha, FULL["tolerances"][0], 0.2)
    mean = scene.duration / run_one(scene, "reference").provenance["counters"]["steps"]
    assert 0.9 < mean * alpha / stable_to() < 1.0


@pytest.mark.parametrize("name", FIXED)
def test_a_resolved_hit_returns_all_and_an_unresolved_one_does_not(name):
    phases = np.linspace(0.05, 1.0, 20)
    worst = [np.abs(rebounds(FIXED[name], wh, phases) - 1.0).max() for wh in (0.17, 0.017)]
    assert worst[1] < worst[0] / 100  # order 2 at least
    assert rebounds(FIXED[name], 1e3, phases).max() > 2.5


def test_a_rigid_wall_throws_back_what_two_steps_by_hand_say():
    """On the wall v1 = (2 s - 1) v0 and h a1 = -4 (1 - s) v0, then half of a1 more: v2 = (4 s - 3) v0."""
    phases = np.array([0.1, 0.3, 0.5])
    thrown = rebounds(FIXED["trapezoidal-index2"], 1e6, phases)
    np.testing.assert_allclose(thrown, 3.0 - 4.0 * phases, rtol=1e-9)


def test_five_bodies_rebound_as_one_mass_does():
    ran = run_impacts(FEW | {"moduli": (1e12,), "impact_steps": (1e-5,)}, 1, None)
    assert (ran["method"].tolist(), set(ran["status"])) == (list(FIXED), {"success"})
    # Rod 4 turns by some 1e-4 rad in the few steps in which it moves a micrometre each.
    assert ran["rebound"].to_numpy() == pytest.approx(ran["theory"].to_numpy(), abs=3e-4)
    assert ran["impulse"].to_numpy() != pytest.approx(1.0, abs=1e-3)  # what few steps make of it


def test_the_page_of_few_runs_has_all_its_values_figures_and_tables(frames, tmp_path, monkeypatch):
    """With the limits of the reference alone: where Exudyn has nothing, nothing is said to be zero."""
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path / "cache"))
    runs = pd.DataFrame(columns=["cell", *COLUMNS]).astype(dict.fromkeys(NUMBERS, float))
    results = study.Results(runs, frames, run_steps(FEW, 1, None))
    monkeypatch.setattr(study, "draw_axes", lambda *_: None)
    study.STUDY.report(results, tmp_path)
    text = (tmp_path / "README.md").read_text("utf-8")
    assert "n/a" not in text.partition("## Appendix")[0]
    linked = set(re.findall(r"\]\((\w+\.\w+)\)", text)) - {"axes.svg"}
    assert {path.name for path in tmp_path.iterdir() if path.is_file()} == linked | {"README.md"}
    assert len(linked) == 4 + 7 + 7
