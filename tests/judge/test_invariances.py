"""Verdict and numbers do not change with what has no meaning: order, units, formats, origins, sampling."""

from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
from by_keywords import compare, compare_recorded
from judged_runs import KINDS, MODELS, compared, each, random_scene, random_tables

from comparison import metrics as signals
from comparison.accuracy.uncertainty import Runs
from comparison.tables.align import align
from comparison.tables.channels import channels
from comparison.tables.foreign import read_tables
from comparison.tables.mapping import load_mapping
from comparison.tables.table import Table
from comparison.verdict.recorded import ProgramRuns
from comparison.words.verdicts import scene_reason

NUMBERS = (
    "coverage", "explained", "outside", "max_difference", "rms_difference", "max_scaled", "rms_scaled",
    "worst_time", "worst_threshold", "scale", "coverage_error", "rms_error",
)  # fmt: skip
SCENES = ((2, 0.0), (3, 0.0), (3, 0.02), (13, 0.0))
"""Seed and fault: two that agree, one that differs, one that is indeterminate."""


@cache
def cases():
    """Runs with their comparison, each made once."""
    judged = [random_tables(seed) for seed in range(20)]
    judged += [random_scene(seed, fault=fault) for seed, fault in SCENES]
    return [(each, compared(each)) for each in judged]


def assert_equal(result, other, *, rel=0.0, besides=""):
    """All numbers of two comparisons, but for rounding of a relative size."""
    assert (result.verdict, set(result.channels)) == (other.verdict, set(other.channels))
    assert result.coverage == pytest.approx(other.coverage, rel=rel, nan_ok=True)
    for name, channel in result.channels.items():
        second = other.channels[name]
        assert channel.verdict == second.verdict, name
        for key in NUMBERS:
            expected = pytest.approx(getattr(second, key), rel=rel, abs=0, nan_ok=True)
            assert key == besides or getattr(channel, key) == expected, (name, key)


def test_exchanging_the_models_changes_the_sign_and_no_number():
    for judged, result in cases():
        other = compared(judged._replace(a=judged.b, b=judged.a), labels=MODELS[::-1])
        # Squares and sums of two in the other order.
        assert_equal(result, other, rel=1e-14)
        for name, channel in result.channels.items():
            np.testing.assert_array_equal(channel.difference, -other.channels[name].difference)
        if result.impacts is None:
            continue
        assert result.shift is not None
        # The other table is interpolated between its samples.
        assert other.shift.value == pytest.approx(-result.shift.value, abs=1e-2 * result.shift.uncertainty)
        swapped = {"count_a": "count_b", "count_b": "count_a", "precision": "recall", "recall": "precision"}
        for part, impacts in result.impacts.items():
            for key, value in vars(impacts).items():
                if key != "pairs":
                    back = getattr(other.impacts[part], swapped.get(key, key))
                    assert back == pytest.approx(value, rel=1e-12, abs=1e-14), key
        y, back = result.channels["slider_y"].metrics, other.channels["slider_y"].metrics
        assert back["correlation"] == pytest.approx(y["correlation"], abs=1e-14)
        assert (back["peak_a"], back["peak_b"]) == (y["peak_b"], y["peak_a"])


def test_the_order_of_columns_does_not_matter():
    for number, (judged, result) in enumerate(cases()):
        rng = np.random.default_rng(number)

        def shuffled(table, rng=rng):
            return replace(table, frame=table.frame[rng.permutation(list(table.frame))])

        other = judged._replace(a=each(judged.a, shuffled), b=each(judged.b, shuffled))
        second = compared(other, only=judged.a.base.channels)
        assert_equal(result, second)
        assert scene_reason(result) == scene_reason(second)
        assert str(result.shift) == str(second.shift)  # bit for bit, also where it is nan


def test_the_origin_of_time_does_not_matter():
    """Distances of times round with the offset's last digit, of 1e-12 s at most; a sample's is 3e-4 s."""
    offset = 4096.0

    def late(table):
        events = table.events
        if events is not None and len(events):
            events = events.assign(start=events["start"] + offset, end=events["end"] + offset)
        return replace(table, frame=table.frame.assign(time=table.time + offset), events=events, pulses=None)

    for judged, _ in cases():
        without = {"scene": None, "period": judged.scene.period}
        result = compared(judged, **without)
        other = compared(judged._replace(a=each(judged.a, late), b=each(judged.b, late)), **without)
        assert_equal(result, other, rel=1e-7, besides="worst_time")
        for name, channel in other.channels.items():
            expected = pytest.approx(result.channels[name].worst_time + offset, abs=1e-9, nan_ok=True)
            assert channel.worst_time == expected
        if result.shift is not None and not result.shift.reason:
            digits = 4 * np.spacing(offset + 2.0)
            assert other.shift.value == pytest.approx(
                result.shift.value, abs=1e-3 * result.shift.uncertainty + digits
            )
        assert (result.impacts is None) == (other.impacts is None)
        if result.impacts is not None:
            assert other.impacts["all"].recall == result.impacts["all"].recall


@pytest.mark.parametrize("offset", [0.0, 1e4, 1.7e9])
def test_late_times_that_two_programs_count_differently_are_the_same_grid(offset):
    """Seconds since 1970 have a last digit of 2e-7: runs with uncertainties would be refused."""
    steps = np.arange(801) * 1e-3
    time = offset + steps
    other = np.nextafter(time, np.inf)

    def runs(time, sign):
        def table(error, time=time):
            y = 0.1 * np.sin(9 * steps) + error * np.cos(5 * steps)
            return Table(pd.DataFrame({"time": time, "slider_y": y}))

        error = sign * 1e-6
        return ProgramRuns(table(error), table(error / 4, np.nextafter(time, np.inf)), table(4 * error))

    result = compare_recorded(runs(time, 1.0), runs(other, -1.0), scene=None, labels=("a", "b"))
    assert result.verdict == "agree"
    # At the largest error: 2e-6.
    assert result.channels["slider_y"].max_difference == pytest.approx(2e-6, rel=1e-6)


# Angles


TIME = np.arange(1001) * 4e-4


def crank(error, turned, shape=9.0):
    """A crank angle with an error, told as a program may tell it."""
    angle = 2 * np.pi * TIME / 0.1 + error * np.sin(shape * TIME) + 1.0
    rate = np.full(TIME.size, 2 * np.pi / 0.1) + error * shape * np.cos(shape * TIME)
    return Table(pd.DataFrame({"time": TIME, "crank_angle": turned(angle), "crank_speed": rate}))


TOLD = {
    "as it is": lambda angle: angle,
    "turns ahead": lambda angle: angle + 6 * np.pi,
    "within a turn": lambda angle: np.mod(angle, 2 * np.pi),
    "within half a turn": lambda angle: np.mod(angle + np.pi, 2 * np.pi) - np.pi,
}


@cache
def judged_angles(size, told="as it is", which=0):
    """Of six runs, three of either program, one counts revolutions in another way than the others."""
    ways = [TOLD[told if n == which else "as it is"] for n in range(6)]
    a, b = (
        ProgramRuns(
            *(crank(sign * error, way) for error, way in zip((1e-6, 2.5e-7, 4e-6), part, strict=True))
        )
        for sign, part in ((1.0, ways[:3]), (size / 1e-6, ways[3:]))
    )
    return compare_recorded(a, b, scene=None, labels=("a", "b"), period=0.1)


@pytest.mark.parametrize("size", [1e-6, 1.0])
@pytest.mark.parametrize("which", range(6))
@pytest.mark.parametrize("told", list(TOLD)[1:])
def test_whole_revolutions_in_any_run_make_no_difference(told, which, size):
    computed, plain = judged_angles(size, told, which), judged_angles(size)
    assert (plain.verdict, plain.exit_code) == ("agree", 0 if size == 1e-6 else 3)  # predictable for 0.02 s
    assert (computed.verdict, computed.until) == (plain.verdict, plain.until)
    channel, other = computed.channels["crank_angle"], plain.channels["crank_angle"]
    # Angles up to 45 rad round at 7e-15, of differences of 1e-6.
    np.testing.assert_allclose(channel.difference, other.difference, rtol=0, atol=5e-14)
    np.testing.assert_allclose(channel.u, other.u, rtol=1e-6)
    assert channel.coverage == other.coverage


# Units and formats

FOREIGN = {
    "m": ("mm", 1e3), "rad": ("deg", 180 / np.pi), "m/s": ("mm/s", 1e3), "rad/s": ("deg/s", 180 / np.pi),
    "m/s^2": ("mm/s^2", 1e3), "rad/s^2": ("deg/s^2", 180 / np.pi), "N": ("kN", 1e-3),
}  # fmt: skip


@pytest.mark.parametrize(("ending", "seed", "fault"), [("csv", 3, 0.02), ("parquet", 2, 0.0)])
def test_units_and_formats_do_not_matter(tmp_path, ending, seed, fault):
    """Tables in ms, mm, deg and kN with names of another program."""
    judged = random_scene(seed, fault=fault)
    columns = {"TIME": ("time", "ms", 1e3)}
    for name in judged.a.base.channels:
        columns[f"press {name}"] = (name, *FOREIGN[channels()[name].unit])
    rules = tmp_path / "mapping.toml"
    rules.write_text(
        "\n".join(f'[columns."{own}"]\nchannel = "{c}"\nunit = "{u}"' for own, (c, u, _) in columns.items())
    )
    paths = []
    for side, runs in zip("ab", judged[2:], strict=True):
        for kind in KINDS:
            frame = getattr(runs, kind).frame
            made = pd.DataFrame({own: frame[c] * factor for own, (c, _, factor) in columns.items()})
            paths.append(tmp_path / f"{side}-{kind}.{ending}")
            made.to_csv(paths[-1], index=False) if ending == "csv" else made.to_parquet(paths[-1])
    tables, left_out = read_tables(paths, [*"aaaaabbbbb"], load_mapping(rules), None)
    assert not [line for line in left_out if "not compared" in line]
    a, b = (
        Runs(refinement=runs.refinement, **dict(zip(KINDS, part, strict=True)))
        for part, runs in zip((tables[:5], tables[5:]), judged[2:], strict=True)
    )
    result, plain = compared(judged._replace(a=a, b=b)), compared(judged)
    assert result.verdict == plain.verdict
    for name, channel in result.channels.items():
        other = plain.channels[name]
        # Two conversions round each number at 2.2e-16 of its size, the differences of two at twice that, and
        # what u makes of them at six times.
        rounding = 4 * np.finfo(float).eps * np.abs(other.a).max()
        np.testing.assert_allclose(channel.difference, other.difference, rtol=0, atol=rounding)
        np.testing.assert_allclose(channel.u, other.u, rtol=1e-9, atol=10 * rounding)
        assert channel.verdict == other.verdict
        # One sample of two thousand may change sides where u is round-off itself.
        assert channel.coverage == pytest.approx(other.coverage, abs=1e-3)
        assert channel.rms_difference == pytest.approx(other.rms_difference, rel=1e-9, abs=rounding)
        assert channel.scale == pytest.approx(other.scale, rel=1e-14)


# Another sampling

FINE = 3000  # samples a cycle; a third of them is what the scenes write


def every(judged, n):
    """The same runs written with a sample in so many."""

    def thinned(table):
        return replace(table, frame=table.frame.iloc[::n].reset_index(drop=True))

    return judged._replace(a=each(judged.a, thinned), b=each(judged.b, thinned))


def changed(result, fine):
    """Change, stated error and size of coverage and RMS of the channels that both samplings excite."""
    for name, channel in result.channels.items():
        other = fine.channels[name]
        if "unexcited" in {channel.verdict, other.verdict}:
            continue  # of a corner that touches once no sample may be left
        yield abs(channel.coverage - other.coverage), channel.coverage_error, 1.0
        yield abs(channel.rms_difference - other.rms_difference), channel.rms_error, other.rms_difference


def lost(result, other):
    """Share of the channels that only one sampling has a judged sample of: a scene's coverage counts them.

    Forces of corners that touch a few times. One that is excited without such a sample covers nothing.
    """
    having = [{name for name, c in of.channels.items() if c.judged.any()} for of in (result, other)]
    excited = [
        {name for name, c in of.channels.items() if c.verdict != "unexcited"} for of in (result, other)
    ]
    return len((having[0] ^ having[1]) | (excited[0] ^ excited[1])) / len(result.channels)


def assert_no_flip(channel, other):
    """One verdict, but where the coverage is as near to its floor as it may be off."""
    floor = next(iter(channel.channels.values())).limits.coverage
    if channel.verdict != other.verdict:
        assert {channel.verdict, other.verdict} == {"agree", "indeterminate"}
        assert abs(channel.coverage - floor) <= max(channel.coverage_error, other.coverage_error)


@pytest.mark.parametrize("seed", [2, 3])
def test_a_third_of_the_samples_gives_the_verdict_of_all_and_their_numbers_within_the_stated_error(seed):
    judged = random_scene(seed, FINE)
    fine, result = compared(judged), compared(every(judged, 3))
    assert_no_flip(result, fine)
    assert abs(result.coverage - fine.coverage) <= result.coverage_error + lost(result, fine) + 1e-3
    pairs = list(changed(result, fine))
    # Measured on 60 scenes from 6000 samples a cycle to 1000: 86 % of coverages, 87 % of RMS of motion and
    # 79 % of forces; the rest are channels of which coarser samples miss the same contacts.
    assert np.mean([change <= error + 1e-3 * size for change, error, size in pairs]) >= 0.75
    assert result.shift is not None
    assert fine.shift is not None
    assert abs(result.shift.value - fine.shift.value) <= result.shift.uncertainty
    # From the events, which no sampling thins.
    assert (
        vars(result.impacts["all"]).pop("pairs").tolist() == vars(fine.impacts["all"]).pop("pairs").tolist()
    )
    assert str(vars(result.impacts["all"])) == str(vars(fine.impacts["all"]))


@pytest.mark.parametrize("seed", range(6))
def test_the_stated_errors_are_those_of_tables_with_fewer_samples(seed):
    """On every second and every fourth row of the files themselves."""
    judged = random_tables(seed) if seed else random_scene(2)
    result, half, quarter = (
        compared(every(judged, n), scene=None, period=judged.scene.period) for n in (1, 2, 4)
    )

    def error(name, key):
        fine, two, four = (getattr(of.channels[name] if name else of, key) for of in (result, half, quarter))
        return 3 * max(abs(two - fine), abs(four - fine) / 2)

    for name, channel in result.channels.items():
        assert channel.coverage_error == pytest.approx(error(name, "coverage"), rel=1e-12, abs=1e-15)
        assert channel.rms_error == pytest.approx(error(name, "rms_difference"), rel=1e-12, abs=1e-18)
    expected = pytest.approx(error("", "coverage"), rel=1e-12, abs=1e-15, nan_ok=True)
    assert result.coverage_error == expected


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("counts", [(1000, 500), (500, 1000), (1000, 997), (1009, 3000), (1000, 1000)])
def test_a_resampled_table_is_compared_alike(seed, counts):
    """Signals of six waves, known everywhere: differences are off by no more than interpolation is."""
    rng = np.random.default_rng(seed)
    waves = list(zip(rng.uniform(-1, 1, 6), 2 * np.pi * np.arange(1, 7), rng.uniform(0, 6, 6), strict=True))
    late, larger = rng.uniform(0, 2e-4), 1 + rng.uniform(0, 2e-3)

    def wave(time, order=0):
        return sum(s * w**order * np.sin(w * time + p + order * np.pi / 2) for s, w, p in waves)

    def table(count, late, larger):
        time = np.linspace(0, 1, count + 1)
        x, v, a = (larger * wave(time - late, order) for order in range(3))
        columns = {"slider_x": x, "slider_vx": v, "slider_ax": a}
        return Table(pd.DataFrame({"time": time} | columns))

    first, second = table(counts[0], 0.0, 1.0), table(counts[1], late, larger)
    result = compare(Runs(first), Runs(second), tolerance=1e-2)
    aligned = align(first, second, ["slider_x", "slider_vx", "slider_ax"])
    fine = np.linspace(0, 1, 20_001)
    h = 1 / max(counts)
    for order, (name, power) in enumerate((("slider_x", 4), ("slider_vx", 2), ("slider_ax", 2))):
        most = sum(abs(s) * w ** (order + power) for s, w, _ in waves)
        allowed = (1e-13 if counts[0] == counts[1] else h**power / {4: 384, 2: 8}[power]) * most * 1.01
        exact = wave(aligned.time, order) - larger * wave(aligned.time - late, order)
        channel = result.channels[name]
        np.testing.assert_allclose(channel.difference, exact, rtol=0, atol=allowed + 1e-12 * most)
        everywhere = wave(fine, order) - larger * wave(fine - late, order)
        # Sums of five hundred samples or more of waves of whole periods; the ends count twice.
        expected = signals.rms(fine, everywhere)
        assert channel.rms_difference == pytest.approx(expected, rel=1e-2, abs=allowed)
        # A wave between two samples is higher by (w h)^2 / 8 at most, h that of the compared times.
        below = (2 * np.pi * 6 / min(counts)) ** 2 / 8 * np.abs(everywhere).max() * 1.01
        assert -below - allowed <= channel.max_difference - np.abs(everywhere).max() <= allowed + 1e-12
        assert channel.rms_error <= 0.1 * expected
        if abs(np.abs(everywhere).max() / np.ptp(wave(fine, order)) - 1e-2) > 1e-3:
            beyond = np.abs(everywhere).max() > 1e-2 * np.ptp(wave(fine, order))
            assert channel.verdict == ("differ" if beyond else "agree")
