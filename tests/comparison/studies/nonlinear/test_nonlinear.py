"""The tools of nonlinear dynamics on systems whose answers are known."""

from __future__ import annotations

from functools import partial
from math import log

import numpy as np
import pytest

from comparison.models import MODELS
from comparison.studies.nonlinear import bouncing_ball as ball
from comparison.studies.nonlinear.chaos import DISTANCES, FORGETTING, MAIN, USUAL, Chaos, believed, verdict
from comparison.studies.nonlinear.methods import (
    CLEAR,
    LEAST,
    Exponent,
    chaos_indicator,
    closest_measured,
    exponents,
    follow,
    growth_rates,
    mean_interval,
    recurrence,
)
from comparison.studies.nonlinear.study import answer, without_memory

FINE = {"round_off": 1e-15}


def orbit(advance, start, count, skip=0):
    state, states = start, []
    for k in range(skip + count):
        state = advance(state)
        if k >= skip:
            states.append(state)
    return np.array(states)


def along(advance, start, periods, distances, **settings):
    """Follow perturbed orbits of a map, given as its stages; times count stages."""
    steps = advance if isinstance(advance, list) else [advance]

    def perturbed(state, when, end):
        del end
        return steps[when % len(steps)](state)

    settings = FINE | {"scale": np.ones(len(start))} | settings
    return follow(
        lambda state, when: (perturbed(state, when, when + 1), when + 1),
        perturbed, np.array(start), 0, periods * len(steps), distances=np.array(distances), **settings,
    )  # fmt: skip


def of_the_ball(amplitude, count=300, skip=100):
    start = ball.on_the_periodic_motion(amplitude) + np.array([0.01, 0.0])  # within the attractor's basin
    return orbit(partial(ball.advance, amplitude=amplitude), start, count, skip)


@pytest.fixture(scope="module")
def regular():
    return of_the_ball(ball.REGULAR)


@pytest.fixture(scope="module")
def chaotic():
    return of_the_ball(ball.CHAOTIC, count=1000)


def test_the_ball_stays_on_its_periodic_motion():
    start = ball.on_the_periodic_motion(ball.REGULAR)
    # One period of additions of numbers near 10: some 1e-15 each, and an impact located to 1e-15.
    assert ball.advance(start, ball.REGULAR) == pytest.approx(start, abs=1e-12)


def test_the_balls_linear_map_is_the_derivative_and_has_the_known_determinant_and_trace():
    e, start = ball.RESTITUTION, ball.on_the_periodic_motion(ball.REGULAR)
    _, tangent = ball.flight(start, ball.REGULAR)
    h = 1e-6
    for k in range(2):
        step = h * np.eye(2)[k]
        ahead, behind = (ball.advance(start + s, ball.REGULAR) for s in (step, -step))
        # Central difference: h^2 times third derivatives of order 10, and round-off 1e-14 / h.
        assert (ahead - behind) / (2 * h) == pytest.approx(tangent[:, k], abs=1e-7)
    table = -np.sqrt(ball.REGULAR**2 - (np.pi * (1 - e) / (1 + e)) ** 2)
    assert np.linalg.det(tangent) == pytest.approx(e**2, abs=1e-10)
    assert np.trace(tangent) == pytest.approx(1 + e**2 + (1 + e) ** 2 * table, abs=1e-10)


@pytest.mark.parametrize(("amplitude", "sign"), [(ball.REGULAR, -1), (ball.CHAOTIC, 1)])
def test_the_methods_give_the_known_answers_of_the_ball(amplitude, sign):
    control = ball.control(amplitude, 600)
    # What differs is the first direction, and what 1e-8 is not small beside (grazing).
    assert control.measured.value == pytest.approx(control.known, abs=0.02)
    assert (control.measured.sign, control.measured.collapsed) == (sign, 0.0)
    assert (control.repeats == 1) == (sign == -1)
    # For 1000 periods of a chaotic series the authors' figures show K above 0.9.
    assert control.indicator > 0.9 if sign == 1 else abs(control.indicator) < 0.2


def test_the_0_1_test_on_the_authors_logistic_map():
    for parameter, chaos in ((3.55, False), (3.97, True)):

        def logistic(x, parameter=parameter):
            return parameter * x * (1 - x)

        series = orbit(logistic, np.array([0.3]), 2000, 200)[:, 0]
        assert (chaos_indicator(series) > 0.95) == chaos
        assert (abs(chaos_indicator(series)) < 0.1) != chaos


def test_the_0_1_test_does_not_depend_on_unit_or_origin_and_refuses_a_short_series(chaotic):
    series = chaotic[:300, 0]
    assert growth_rates(1e-4 * series - 0.55) == pytest.approx(growth_rates(series), abs=1e-6)
    assert chaos_indicator(np.full(LEAST, 3.0)) == 0.0
    with pytest.raises(ValueError, match="100 periods or more, not 99"):
        growth_rates(series[: LEAST - 1])


def test_sections_show_one_point_two_points_and_no_end(chaotic, regular):
    assert recurrence(regular, 1e-9) == 1
    e = ball.RESTITUTION
    doubled = np.hypot(np.pi * (1 - e) / (1 + e), 2 * (1 + e * e) / (1 + e) ** 2)
    # Near the doubling the motion settles slowly (as e^-2k(A - A')): 600 periods are enough 1 % away from it.
    assert recurrence(of_the_ball(0.99 * doubled, 40, 600), 1e-6) == 1
    assert recurrence(of_the_ball(1.01 * doubled, 40, 600), 1e-6) == 2
    assert recurrence(chaotic, 1e-3) is None


def test_the_interval_of_a_mean_covers_it_as_often_as_it_says():
    rng = np.random.default_rng(3)
    n, covered = 400, 0
    for k in range(200):
        noise, x = rng.normal(size=n), np.empty(n)
        x[0] = noise[0] / np.sqrt(1 - 0.3**2)
        for i in range(1, n):
            x[i] = 0.3 * x[i - 1] + noise[i]
        low, high = mean_interval(x, seed=k)
        covered += low <= 0.0 <= high
    # 95 % asked; blocks of 7 see nearly all of a correlation of 0.3. Without blocks 83 % are covered.
    assert 178 <= covered <= 199


def test_collapsed_orbits_give_a_bound_and_keep_their_direction():
    """Every other stage forgets its start but for an error of 1e-9, the others double the distance."""
    counter = {"runs": 0}

    def advance(state):
        odd = (counter["runs"] // 3) % 2  # the orbit, the perturbed one at round-off, the other one
        counter["runs"] += 1
        return 2.0 * state if odd else np.array([1e-9 * (counter["runs"] % 3), 0.0])

    orbits = along(advance, [0.0, 0.0], 10, [1e-6], round_off=1e-12)
    assert orbits.collapsed[0].tolist() == [True, False] * 5
    assert np.exp(orbits.logs[0]) == pytest.approx([CLEAR * 1e-3, 2.0] * 5, rel=1e-9)
    assert exponents(orbits, 1)[0].collapsed == 0.5
    # Both kinds of stage as the stages of one period: every one has a collapsed stage.
    assert exponents(orbits, 2)[0].collapsed == 1.0
    assert exponents(orbits, 2)[0].value == pytest.approx(log(CLEAR * 1e-3) + log(2.0), rel=1e-9)


def test_a_bound_above_zero_says_nothing_and_one_below_tells_the_sign():
    bound, whole = Exponent(0.5, 0.4, 0.6, collapsed=0.2), Exponent(0.5, 0.4, 0.6, collapsed=0.0)
    lower = Exponent(-0.5, -0.6, -0.4, collapsed=0.9)
    assert (bound.sign, whole.sign, lower.sign) == (0, 1, -1)
    assert closest_measured([bound, whole, lower]) is whole
    assert closest_measured([bound, lower]) is lower


def test_stages_show_a_growth_that_over_a_whole_period_takes_errors_to_the_attractors_size():
    """Twice a period distances grow by 1e5 on a circle of length 1, with an error of 1e-12."""
    rng = np.random.default_rng(5)

    def half(state):
        return (1e5 * (state + 1e-12 * rng.normal(size=1))) % 1.0

    (lost,) = exponents(along(lambda state: half(half(state)), [1 / np.pi], 50, [1e-10]), 1)
    assert lost.value < 2 * log(1e5) - 0.5  # 1e-10 would become 1
    parts = along([half, half], [1 / np.pi], 50, [3e-10])
    (found,) = exponents(parts, 2)
    assert found.collapsed == 0.0
    # 0.5 % of error beside the distance in each of 100 logarithms, and one wrap round the circle in 3e4.
    assert found.value == pytest.approx(2 * log(1e5), abs=0.01)


def test_a_scene_is_judged_by_the_orbits_that_could_be_followed():
    chaotic = [Exponent(2.0, 1.5, 2.5, 0.0)] * len(DISTANCES["reference"])
    best = believed({(MAIN, "reference", 1e-10): chaotic, (MAIN, "exudyn", 1e-10): []}, {MAIN: 1e-6})
    assert list(best) == [(MAIN, "reference", 1e-10)]
    assert list(answer(best, MAIN).values()) == [MAIN, "**undecided**", "2.00", "1 of 1", "n/a", "0 of 0"]


@pytest.mark.parametrize(
    ("reference", "exudyn", "expected"),
    [
        ([(2.0, 0.0), (1.0, 0.0)], [(2.0, 0.0)], Chaos.CHAOTIC),
        ([(2.0, 0.0), (1.0, 0.9)], [(2.0, 0.0)], Chaos.CHAOTIC),  # a bound above zero says nothing
        ([(2.0, 0.0)], [(2.0, 0.9)], Chaos.UNDECIDED),  # one model alone measures it
        ([(2.0, 0.0), (0.1, 0.0)], [(2.0, 0.0)], Chaos.UNDECIDED),  # one interval holds zero
        ([(2.0, 0.0)], [(-2.0, 0.0)], Chaos.UNDECIDED),
        ([(-2.0, 0.0), (-1.0, 0.9)], [(-2.0, 0.9)], Chaos.REGULAR),  # a bound below zero is enough
        ([(-2.0, 0.0)], [(0.1, 0.0)], Chaos.UNDECIDED),
        ([], [], Chaos.UNDECIDED),
    ],
)
def test_a_scene_is_chaotic_where_every_run_of_both_models_that_measures_it_says_so(
    reference, exudyn, expected
):
    best = {
        (MAIN, model, 10.0**-k): Exponent(value, value - 0.5, value + 0.5, collapsed)
        for model, of in (("reference", reference), ("exudyn", exudyn))
        for k, (value, collapsed) in enumerate(of)
    }
    best["another", "reference", 1e-10] = Exponent(9.0, 8.0, 10.0, 0.0)
    assert verdict(best, MAIN) is expected
    assert answer(best, MAIN)["verdict"] == f"**{expected.value}**"


@pytest.mark.parametrize(
    ("without", "scatter", "sentence"),
    [
        (Exponent(4.0, 3.0, 5.0, 0.0), 1e-3, "60 % of the exponent is the law's memory"),
        (Exponent(-1.0, -2.0, -0.5, 0.0), 1e-9, "all of the magnification"),
        # Whose cycles all collapsed may contract: only the scatter tells.
        (Exponent(4.0, 3.0, 5.0, 1.0), 1e-7, "the cycles of this scene repeat"),
        (Exponent(4.0, 3.0, 5.0, 1.0), 5e-4, "with it by 1.0\u00a0mm."),
    ],
)
def test_of_the_memory_no_more_is_said_than_the_exponents_tell(without, scatter, sentence):
    best = {(MAIN, model, USUAL[model]): Exponent(10.0, 9.0, 11.0, 0.0) for model in MODELS}
    best |= {(FORGETTING, model, USUAL[model]): without for model in MODELS}
    sizes = {MAIN: np.array([1e-9, 1e-3]), FORGETTING: np.array([1e-13, scatter])}
    assert sentence in without_memory(best, sizes)
