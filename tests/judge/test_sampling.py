"""Another sampling changes a verdict nowhere but at its floor, and numbers by about as much as is stated."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from judged_runs import Judged, compared, each, random_scene, random_tables

from comparison.formatting import percent
from comparison.tables.table import Table
from comparison.verdict.results import ChannelComparison, SceneComparison

SEEDS = (2, 3)
FINE = 3000  # samples a cycle; a third of them is what the scenes write


def every(judged: Judged, n: int) -> Judged:
    """The same runs written with a sample in so many."""

    def thinned(table: Table) -> Table:
        return replace(table, frame=table.frame.iloc[::n].reset_index(drop=True))

    return judged._replace(a=each(judged.a, thinned), b=each(judged.b, thinned))


def changed(found: SceneComparison, fine: SceneComparison) -> Iterator[tuple[float, float, float]]:
    """Change, stated error and size of coverage and RMS of the channels that both samplings excite."""
    for name, channel in found.channels.items():
        other = fine.channels[name]
        if "unexcited" in {channel.verdict, other.verdict}:
            continue  # of a corner that touches once no sample may be left
        yield abs(channel.coverage - other.coverage), channel.coverage_error, 1.0
        yield abs(channel.rms_difference - other.rms_difference), channel.rms_error, other.rms_difference


def lost(found: SceneComparison, other: SceneComparison) -> float:
    """Share of the channels that only one sampling has a judged sample of: a scene's coverage counts them.

    Forces of corners that touch a few times. One that is excited without such a sample covers nothing.
    """
    having = [{name for name, c in of.channels.items() if c.judged.any()} for of in (found, other)]
    excited = [{name for name, c in of.channels.items() if c.verdict != "unexcited"} for of in (found, other)]
    return len((having[0] ^ having[1]) | (excited[0] ^ excited[1])) / len(found.channels)


def assert_no_flip(
    channel: ChannelComparison | SceneComparison, other: ChannelComparison | SceneComparison
) -> None:
    """One verdict, but where the coverage is as near to its floor as it may be off."""
    floor = next(iter(channel.channels.values())).limits.coverage
    if channel.verdict != other.verdict:
        assert {channel.verdict, other.verdict} == {"agree", "indeterminate"}
        assert abs(channel.coverage - floor) <= max(channel.coverage_error, other.coverage_error)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_third_of_the_samples_gives_the_verdict_of_all_and_their_numbers_within_the_stated_error(seed):
    judged = random_scene(seed, FINE)
    fine, found = compared(judged), compared(every(judged, 3))
    assert_no_flip(found, fine)
    assert abs(found.coverage - fine.coverage) <= found.coverage_error + lost(found, fine) + 1e-3
    pairs = list(changed(found, fine))
    # Measured on 60 scenes from 6000 samples a cycle to 1000: 86 % of coverages, 87 % of RMS of motion and
    # 79 % of forces; the rest are channels of which coarser samples miss the same contacts.
    assert np.mean([change <= error + 1e-3 * size for change, error, size in pairs]) >= 0.75
    assert found.shift is not None
    assert fine.shift is not None
    assert abs(found.shift.value - fine.shift.value) <= found.shift.uncertainty
    # From the events, which no sampling thins.
    assert vars(found.impacts["all"]).pop("pairs").tolist() == vars(fine.impacts["all"]).pop("pairs").tolist()
    assert str(vars(found.impacts["all"])) == str(vars(fine.impacts["all"]))


@pytest.mark.parametrize("seed", [2])
def test_runs_written_with_another_number_of_samples_have_one_verdict(seed):
    """Here the integrators stop at other times as well; 997 is a prime number."""
    results = [compared(random_scene(seed, count)) for count in (1000, 500, 997)]
    for other in results[1:]:
        assert_no_flip(results[0], other)
        allowed = results[0].coverage_error + other.coverage_error + lost(results[0], other) + 1e-3
        assert abs(results[0].coverage - other.coverage) <= allowed


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20, 44))
def test_many_scenes_have_one_verdict_at_any_sampling(seed):
    judged = random_scene(seed, FINE)
    fine = compared(judged)
    results = [compared(every(judged, n)) for n in (2, 3, 6, 12)]
    results += [compared(random_scene(seed, count)) for count in (500, 997, 1000, 1999)]
    for found in results:
        assert_no_flip(found, fine)
        assert "differ" not in {channel.verdict for channel in found.channels.values()}


@pytest.mark.parametrize("seed", range(12))
def test_the_stated_errors_are_those_of_tables_with_fewer_samples(seed):
    """On every second and every fourth row of the files themselves."""
    judged = random_tables(seed) if seed else random_scene(2)
    found, half, quarter = (
        compared(every(judged, n), scene=None, period=judged.scene.period) for n in (1, 2, 4)
    )

    def error(name: str, key: str) -> float:
        fine, two, four = (getattr(of.channels[name] if name else of, key) for of in (found, half, quarter))
        return 3 * max(abs(two - fine), abs(four - fine) / 2)

    for name, channel in found.channels.items():
        assert channel.coverage_error == pytest.approx(error(name, "coverage"), rel=1e-12, abs=1e-15)
        assert channel.rms_error == pytest.approx(error(name, "rms_difference"), rel=1e-12, abs=1e-18)
    expected = pytest.approx(error("", "coverage"), rel=1e-12, abs=1e-15, nan_ok=True)
    assert found.coverage_error == expected


def test_of_a_few_samples_no_error_is_stated():
    few = every(random_tables(1), 20)
    assert few.a.base.time.size < 16
    found = compared(few, scene=None)
    assert np.isnan(found.coverage_error)
    assert np.isnan([channel.rms_error for channel in found.channels.values()]).all()


def test_an_error_stands_beside_a_share_where_its_digits_show_it():
    assert percent(0.66405, 0.0031).replace("\u00a0", " ") == "66.40 ± 0.3 %"
    assert percent(0.66405, 0.12).replace("\u00a0", " ") == "66.40 ± 10 %"
    assert percent(0.66405, 4e-5).replace("\u00a0", " ") == "66.40 %"
    assert percent(1.0).replace("\u00a0", " ") == percent(1.0, float("nan")).replace("\u00a0", " ") == "100 %"
