"""Stability of steps: theory against brute force, and a few runs for real."""

from __future__ import annotations

import cmath
import math
import re

import numpy as np
import pytest
from scipy.integrate import DOP853

from comparison.execution.run import run_one
from comparison.studies.extremes.step_stability import explicit
from comparison.studies.extremes.step_stability.baumgarte import scene as gains_scene
from comparison.studies.extremes.step_stability.contacts import Impact
from comparison.studies.extremes.step_stability.fixed_steps import (
    METHODS,
    amplification,
    rebounds,
    spectral_radius,
)
from comparison.studies.extremes.step_stability.section import STUDY


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
    alpha = STUDY.full.gains[-1]
    scene = gains_scene("ideal slider", alpha, alpha, STUDY.full.tolerances[0], 0.2)
    mean = scene.duration / run_one(scene, "reference").provenance["counters"]["steps"]
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
    impact = Impact(name, step, young, 0.375)
    scene = impact.scene()
    ran = run_one(scene, "exudyn")
    rebound = ran.values("slider_vx")[-1] / -scene.data["initial"]["slider_vx"]
    expected = rebounds(METHODS[name], impact.wh, np.array([0.375]))[0]
    # Rod 4 turns by some 1e-4 rad in the few steps in which it moves a micrometre each.
    assert rebound == pytest.approx(expected, abs=3e-4)


def test_the_section_of_few_runs_has_all_its_values_and_figures(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path / "cache"))
    results = STUDY.measure(STUDY.small, 2, None)
    text = STUDY.text(results)
    assert not re.search(r"\{\w*\}|\bnan\b", text)
    STUDY.draw(results, tmp_path)
    figures = set(re.findall(r"\((\w+\.svg)\)", text))
    assert figures == {path.name for path in tmp_path.glob("*.svg")}
    assert len(figures) == 4
