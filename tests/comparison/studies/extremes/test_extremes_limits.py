"""The quantitative parts of the study extremes: theory against brute force, rates on the reference alone."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from scipy.integrate import DOP853

from comparison.execution.run import Job, Outcome, runner
from comparison.studies.extremes import (
    baumgarte,
    clearance_limit,
    elastic_limit,
    explicit,
    speed_limit,
    stability,
    stiffness_limit,
)
from comparison.studies.extremes.fixed_steps import METHODS, amplification, rebounds, spectral_radius
from comparison.studies.extremes.impact import restitution
from comparison.studies.shared.rates import rate


def after(steps: int, z: complex) -> float:
    """Return |y| after so many steps of DOP853 on y' = z y, h = 1, stage by stage."""
    y = 1.0 + 0.0j
    for _ in range(steps):
        slopes: list[complex] = []
        for row in DOP853.A:
            slopes.append(z * (y + sum(a * k for a, k in zip(row, slopes, strict=False))))
        y += sum(b * k for b, k in zip(DOP853.B, slopes, strict=True))
    return abs(y)


@pytest.mark.parametrize("degrees", [180.0, 150.0, 120.0, 95.0, 90.0])
def test_the_stability_limit_of_dop853_parts_decay_from_growth(degrees) -> None:
    direction = cmath.exp(1j * math.radians(degrees))
    S = explicit.limit(direction)
    assert after(400, 0.99 * S * direction) < 1.0
    assert after(400, 1.01 * S * direction) > 2.0


def test_a_growing_root_has_no_stable_step() -> None:
    assert explicit.limit(1.0) == 0.0


def test_roots_of_the_constraint_error() -> None:
    for alpha, beta in ((5.0, 5.0), (5.0, 2.0), (2.0, 5.0)):
        for root in explicit.baumgarte_roots(alpha, beta):
            assert root**2 + 2 * alpha * root + beta**2 == pytest.approx(0.0, abs=1e-12)
    assert explicit.longest_step(0.0, 0.0) == math.inf


def test_the_reference_takes_the_steps_that_stability_allows() -> None:
    """Loose tolerance, stiff error equation: the error control has nothing else to follow."""
    alpha = baumgarte.GAINS[-1]
    scene = baumgarte.scene("ideal slider", alpha, alpha, baumgarte.TOLERANCES[0], 0.2)
    mean = scene.duration / runner("reference")(scene).provenance["counters"]["steps"]
    assert 0.9 < mean / explicit.longest_step(alpha, alpha) < 1.0


@pytest.mark.parametrize("name", METHODS)
def test_methods_of_fixed_steps_are_of_order_two(name) -> None:
    """Cosine up to w t = 3."""
    errors = []
    for steps in (100, 200):
        wh = 3.0 / steps
        state = np.linalg.matrix_power(amplification(METHODS[name], wh), steps) @ [
            1.0,
            0.0,
            -(wh**2),
            -(wh**2),
        ]
        errors.append(abs(state[0] - math.cos(3.0)))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


def test_spectral_radii() -> None:
    for wh in (1e-2, 1.0, 3.0, 1e2, 1e6):
        assert spectral_radius(METHODS["trapezoidal-index2"], wh) == pytest.approx(1.0, abs=1e-9)
        assert spectral_radius(METHODS["generalized-alpha"], wh) <= 1.0 + 1e-12
    assert spectral_radius(METHODS["generalized-alpha"], 1e6) == pytest.approx(0.9, abs=1e-4)


@pytest.mark.parametrize("name", METHODS)
def test_a_resolved_hit_returns_all_and_an_unresolved_one_does_not(name) -> None:
    phases = np.linspace(0.05, 1.0, 20)
    worst = [np.abs(rebounds(METHODS[name], wh, phases) - 1.0).max() for wh in (0.17, 0.017)]
    assert worst[1] < worst[0] / 100  # order 2 at least
    assert rebounds(METHODS[name], 1e3, phases).max() > 2.5


def test_a_rigid_wall_throws_back_what_two_steps_by_hand_say() -> None:
    """On the wall v1 = (2 s - 1) v0 and h a1 = -4 (1 - s) v0, then half of a1 more: v2 = (4 s - 3) v0."""
    phases = np.array([0.1, 0.3, 0.5])
    np.testing.assert_allclose(
        rebounds(METHODS["trapezoidal-index2"], 1e6, phases), 3.0 - 4.0 * phases, rtol=1e-9
    )


@pytest.mark.parametrize(("step", "young"), [(1e-5, 1e9), (1e-5, 1e12)])
@pytest.mark.parametrize("name", METHODS)
def test_five_bodies_rebound_as_one_mass_does(name, step, young) -> None:
    scene = stability.hit_scene(name, step, young, 0.375)
    ran = runner("exudyn")(scene)
    rebound = ran.values("slider_vx")[-1] / -scene.data["initial"]["slider_vx"]
    expected = rebounds(METHODS[name], stability.frequency(young) * step, np.array([0.375]))[0]
    # Rod 4 turns by some 1e-4 rad in the few steps in which it moves a micrometre each.
    assert rebound == pytest.approx(expected, abs=3e-4)


def test_restitution_of_the_law() -> None:
    assert restitution(0.9) == pytest.approx(0.9131766778, abs=1e-10)
    assert restitution(1.0) == 1.0


def test_rate_leaves_out_what_has_no_logarithm() -> None:
    assert rate([1.0, 2.0, 4.0, 8.0], [3.0, 12.0, 48.0, math.nan]) == pytest.approx(2.0)
    assert math.isnan(rate([1.0, 2.0], [1.0, 0.0]))


def by_the_reference(jobs: list[Job]) -> list[Outcome]:
    """Run those of the reference; Exudyn's, which take longer, are said to have crashed."""
    run = runner("reference")
    return [
        Outcome("success", table=run(job.scene)) if job.model == "reference" else Outcome("crashed")
        for job in jobs
    ]


def test_clearance_to_zero() -> None:
    rows = clearance_limit.rows(by_the_reference(clearance_limit.jobs()))
    rates = clearance_limit.rates(rows, "reference")
    # The depth is a tenth of the smallest clearance of these: it takes some hundredths from the order.
    assert rates["x"][0] == pytest.approx(1.0, abs=0.05)
    assert rates["y"][0] == pytest.approx(1.0, abs=0.05)
    assert rates["vx"][0] == pytest.approx(0.5, abs=0.1)
    assert rates["x"][1] < 0.3
    for row in rows:
        if row.model == "reference":
            assert row.y <= 0.2095 * 1.001 * row.x
    assert "exudyn: crashed" in clearance_limit.text(rows)


def test_stiffness_to_infinity() -> None:
    rows = stiffness_limit.rows(by_the_reference(stiffness_limit.jobs()))
    for corners in stiffness_limit.TILTS:
        rates = stiffness_limit.rates(rows, corners, "reference")
        assert rates["depth"] == pytest.approx(-0.4, abs=0.005)
        assert rates["duration"] == pytest.approx(-0.4, abs=0.005)
        assert rates["restitution"] == pytest.approx(-0.4, abs=0.01)
        assert rates["x in flight 1"] == pytest.approx(-0.4, abs=0.02)
    stiffest = [row for row in rows if row.model == "reference" and row.modulus == 1e15]
    for row in stiffest:
        assert row.returned == pytest.approx(stiffness_limit.exact(), abs=1e-3)
        assert row.deepest == pytest.approx(row.exact_depth, rel=3e-4)
    assert "exudyn: crashed" in stiffness_limit.text(rows)


def test_nothing_is_lost_that_cannot_be() -> None:
    rows = elastic_limit.rows(by_the_reference(elastic_limit.jobs()))
    ran = [row for row in rows if row.model == "reference"]
    assert all(row.damping == 0.0 for row in ran if row.case != elastic_limit.NO_FRICTION)
    assert all(row.friction == 0.0 for row in ran if row.case != elastic_limit.NO_DAMPING)
    assert all(row.damping > 0.0 for row in ran if row.case == elastic_limit.NO_FRICTION)
    assert all(row.friction > 0.0 for row in ran if row.case == elastic_limit.NO_DAMPING)
    assert 0.5 < elastic_limit.rates(rows)["reference"] < 1.1
    assert "exudyn: crashed" in elastic_limit.text(rows)


def test_speed_to_zero() -> None:
    rows = speed_limit.rows(by_the_reference(speed_limit.jobs()))
    smooth = speed_limit.rates(rows, 0.0, "reference")
    for name in ("force", "torque", "kinetic"):
        assert smooth[name] == pytest.approx(2.0, abs=0.02)
    # At 60 rpm the force differs from the static one by half of it: the depth, its power 2/3, is not linear.
    assert smooth["depth"] == pytest.approx(2.0, abs=0.05)
    rough = [row for row in rows if row.friction and row.model == "reference"]
    assert rough[-1].torque == pytest.approx(rough[-2].torque, rel=0.05)  # what does not vanish
    assert "exudyn: crashed" in speed_limit.text(rows)
