"""Verdict and numbers do not change with what has no meaning: order, units, formats, origins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import second_judge
from judged_runs import KINDS, MODELS, Judged, compared, each, random_scene, random_tables
from scipy.io import savemat

from comparison.accuracy.uncertainty import WINDOW, Runs
from comparison.agreement.compare import compare, model_uncertainty
from comparison.agreement.recorded_runs import Recorded, compare_recorded
from comparison.agreement.results import SceneComparison
from comparison.metrics import norms
from comparison.scene import load_scene
from comparison.tables.align import align
from comparison.tables.channels import channels
from comparison.tables.imports.mapping import load_mapping
from comparison.tables.imports.text import read_tables
from comparison.tables.table import Table

NUMBERS = (
    "coverage", "explained", "outside", "max_difference", "rms_difference", "max_scaled", "rms_scaled",
    "worst_time", "worst_threshold", "scale", "coverage_error", "rms_error",
)  # fmt: skip
SCENES = ((2, 0.0), (3, 0.0), (3, 0.02), (13, 0.0))
"""Seed and fault: two that agree, one that differs, one that is indeterminate."""


def cases() -> list[Judged]:
    return [random_tables(seed) for seed in range(30)] + [
        random_scene(seed, fault=fault) for seed, fault in SCENES
    ]


def assert_equal(
    found: SceneComparison, other: SceneComparison, *, rel: float = 0.0, besides: str = ""
) -> None:
    """All numbers of two comparisons, but for rounding of a relative size."""
    assert (found.verdict, set(found.channels)) == (other.verdict, set(other.channels))
    assert found.coverage == pytest.approx(other.coverage, rel=rel, nan_ok=True)
    for name, channel in found.channels.items():
        second = other.channels[name]
        assert channel.verdict == second.verdict, name
        for key in NUMBERS:
            expected = pytest.approx(getattr(second, key), rel=rel, abs=0, nan_ok=True)
            assert key == besides or getattr(channel, key) == expected, (name, key)


def test_exchanging_the_models_changes_the_sign_and_no_number():
    for judged in cases():
        found = compared(judged)
        other = compared(judged._replace(a=judged.b, b=judged.a), labels=MODELS[::-1])
        # Squares and sums of two in the other order.
        assert_equal(found, other, rel=1e-14)
        for name, channel in found.channels.items():
            np.testing.assert_array_equal(channel.difference, -other.channels[name].difference)
        if found.impacts is None:
            continue
        assert found.shift is not None
        # The other table is interpolated between its samples.
        assert other.shift.value == pytest.approx(-found.shift.value, abs=1e-2 * found.shift.uncertainty)
        swapped = {"count_a": "count_b", "count_b": "count_a", "precision": "recall", "recall": "precision"}
        for part, impacts in found.impacts.items():
            for key, value in vars(impacts).items():
                if key != "pairs":
                    back = getattr(other.impacts[part], swapped.get(key, key))
                    assert back == pytest.approx(value, rel=1e-12, abs=1e-14), key
        y, back = found.channels["slider_y"].metrics, other.channels["slider_y"].metrics
        magnitude = 1 / (1 + y["sprague_geers_magnitude"]) - 1
        assert back["sprague_geers_magnitude"] == pytest.approx(magnitude, abs=1e-14)
        assert back["sprague_geers_phase"] == pytest.approx(y["sprague_geers_phase"], rel=1e-6, abs=1e-15)


def test_by_a_tolerance_the_first_table_is_the_reference_and_its_range_the_scale():
    for seed in range(20):
        judged = random_tables(seed)
        a, b = Runs(judged.a.base), Runs(judged.b.base)
        there, back = (
            compare(*pair, scene=judged.scene, tolerance=0.01, only=a.base.channels)
            for pair in ((a, b), (b, a))
        )
        for name, channel in there.channels.items():
            other = back.channels[name]
            assert channel.max_difference == other.max_difference
            assert channel.rms_difference == other.rms_difference
            if channels()[name].scale == "range":
                assert (channel.scale, other.scale) == (
                    np.ptp(a.base.values(name)),
                    np.ptp(b.base.values(name)),
                )
            else:
                assert channel.scale == other.scale
            if channel.scale == other.scale:
                assert (channel.verdict, channel.outside) == (other.verdict, other.outside)


def test_the_order_of_columns_does_not_matter():
    for number, judged in enumerate(cases()):
        rng = np.random.default_rng(number)

        def shuffled(table: Table, rng: np.random.Generator = rng) -> Table:
            return replace(table, frame=table.frame[rng.permutation(list(table.frame))])

        other = judged._replace(a=each(judged.a, shuffled), b=each(judged.b, shuffled))
        found, second = compared(judged), compared(other, only=judged.a.base.channels)
        assert_equal(found, second)
        assert found.reason == second.reason
        assert str(found.shift) == str(second.shift)  # bit for bit, also where it is nan


@pytest.mark.parametrize("offset", [0.25, 64.0, 4096.0])
def test_the_origin_of_time_does_not_matter(offset):
    """Distances of times round with the offset's last digit, of 1e-12 s at most; a sample's is 3e-4 s."""

    def late(table: Table) -> Table:
        events = table.events
        if events is not None and len(events):
            events = events.assign(start=events["start"] + offset, end=events["end"] + offset)
        return replace(table, frame=table.frame.assign(time=table.time + offset), events=events, pulses=None)

    for judged in cases():
        without = {"scene": None, "period": judged.scene.period}
        found = compared(judged, **without)
        other = compared(judged._replace(a=each(judged.a, late), b=each(judged.b, late)), **without)
        assert_equal(found, other, rel=1e-7, besides="worst_time")
        for name, channel in other.channels.items():
            expected = pytest.approx(found.channels[name].worst_time + offset, abs=1e-9, nan_ok=True)
            assert channel.worst_time == expected
        if found.shift is not None and not found.shift.reason:
            digits = 4 * np.spacing(offset + 2.0)
            assert other.shift.value == pytest.approx(
                found.shift.value, abs=1e-3 * found.shift.uncertainty + digits
            )
        assert (found.impacts is None) == (other.impacts is None)
        if found.impacts is not None:
            assert other.impacts["all"].recall == found.impacts["all"].recall


@pytest.mark.parametrize("offset", [0.0, 1e4, 1.7e9])
def test_late_times_that_two_programs_count_differently_are_the_same_grid(offset):
    """Seconds since 1970 have a last digit of 2e-7: runs with uncertainties would be refused."""
    steps = np.arange(801) * 1e-3
    time = offset + steps
    other = np.nextafter(time, np.inf)

    def runs(time: np.ndarray, sign: float) -> Recorded:
        def table(error: float, time: np.ndarray = time) -> Table:
            y = 0.1 * np.sin(9 * steps) + error * np.cos(5 * steps)
            return Table(pd.DataFrame({"time": time, "slider_y": y}))

        error = sign * 1e-6
        return Recorded(table(error), table(error / 4, np.nextafter(time, np.inf)), table(4 * error))

    result = compare_recorded(runs(time, 1.0), runs(other, -1.0), scene=None, labels=("a", "b"))
    assert result.verdict == "agree"
    # At the largest error: 2e-6.
    assert result.channels["slider_y"].max_difference == pytest.approx(2e-6, rel=1e-6)


# Angles


TIME = np.arange(1001) * 4e-4


def crank(error: float, turned: Callable[[np.ndarray], np.ndarray], shape: float = 9.0) -> Table:
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


@pytest.mark.parametrize("size", [1e-6, 1.0])
@pytest.mark.parametrize("which", range(6))
@pytest.mark.parametrize("told", TOLD)
def test_whole_revolutions_in_any_run_make_no_difference(told, which, size):
    def result(told: str) -> SceneComparison:
        # The finer run of a, say, counts revolutions in another way than the others.
        ways = [TOLD[told if n == which else "as it is"] for n in range(6)]
        a, b = (
            Recorded(
                *(crank(sign * error, way) for error, way in zip((1e-6, 2.5e-7, 4e-6), part, strict=True))
            )
            for sign, part in ((1.0, ways[:3]), (size / 1e-6, ways[3:]))
        )
        return compare_recorded(a, b, scene=None, labels=("a", "b"), period=0.1)

    found, plain = result(told), result("as it is")
    assert plain.verdict == ("agree" if size == 1e-6 else "indeterminate")
    assert found.verdict == plain.verdict
    channel, other = found.channels["crank_angle"], plain.channels["crank_angle"]
    # Angles up to 45 rad round at 7e-15, of differences of 1e-6.
    np.testing.assert_allclose(channel.difference, other.difference, rtol=0, atol=5e-14)
    np.testing.assert_allclose(channel.u, other.u, rtol=1e-6)
    assert channel.coverage == other.coverage


# Units and formats


FOREIGN = {
    "m": ("mm", 1e3), "rad": ("deg", 180 / np.pi), "m/s": ("mm/s", 1e3), "rad/s": ("deg/s", 180 / np.pi),
    "m/s^2": ("mm/s^2", 1e3), "rad/s^2": ("deg/s^2", 180 / np.pi), "N": ("kN", 1e-3),
}  # fmt: skip


def written(table: Table, path: Path) -> Path:
    """A table in ms, mm, deg and kN with names of another program, in the format of the path's ending."""
    frame = pd.DataFrame({"TIME": table.time * 1e3})
    for name in table.channels:
        frame[f"press {name}"] = table.values(name) * FOREIGN[channels()[name].unit][1]
    if path.suffix == ".csv":
        frame.to_csv(path, index=False)
    elif path.suffix == ".parquet":
        frame.to_parquet(path)
    elif path.suffix == ".mat":
        savemat(path, {f"v{n}": frame[name].to_numpy() for n, name in enumerate(frame)})
    else:
        path.write_text("made elsewhere\n" + frame.to_csv(sep="\t", index=False))
    return path


def mapped(table: Table, path: Path, *, numbered: bool) -> Path:
    """The mapping of its columns."""
    names = ["TIME", *(f"press {name}" for name in table.channels)]
    lines = []
    for number, (name, channel) in enumerate(zip(names, ["time", *table.channels], strict=True)):
        unit = "ms" if channel == "time" else FOREIGN[channels()[channel].unit][0]
        column = f"v{number}" if numbered else name
        lines.append(f'[columns."{column}"]\nchannel = "{channel}"\nunit = "{unit}"\n')
    path.write_text("\n".join(lines))
    return path


def only(runs: Runs, kinds: tuple[str, ...]) -> Runs:
    return Runs(refinement=runs.refinement, **{kind: getattr(runs, kind) for kind in kinds})


@pytest.mark.parametrize("ending", ["csv", "parquet", "mat", "txt"])
@pytest.mark.parametrize(("seed", "fault"), [(2, 0.0), (3, 0.02)])
def test_units_and_formats_do_not_matter(tmp_path, ending, seed, fault):
    judged = random_scene(seed, fault=fault)
    kinds = KINDS[:2] if ending == "mat" else KINDS  # each file of MATLAB is read by a process of its own
    judged = judged._replace(**{side: only(runs, kinds) for side, runs in zip("ab", judged[2:], strict=True)})
    paths = [
        written(getattr(runs, kind), tmp_path / f"{side}-{kind}.{ending}")
        for side, runs in zip("ab", judged[2:], strict=True)
        for kind in kinds
    ]
    rules = load_mapping(mapped(judged.a.base, tmp_path / "mapping.toml", numbered=ending == "mat"))
    count = len(kinds)
    tables, left_out = read_tables(paths, ["a"] * count + ["b"] * count, rules, None)
    assert not [line for line in left_out if "not compared" in line]
    a, b = (
        Runs(refinement=runs.refinement, **dict(zip(kinds, part, strict=True)))
        for part, runs in zip((tables[:count], tables[count:]), judged[2:], strict=True)
    )
    found = compared(judged._replace(a=a, b=b))
    plain = compared(judged)
    assert found.verdict == plain.verdict
    for name, channel in found.channels.items():
        other = plain.channels[name]
        # Two conversions round each number at 2.2e-16 of its size, the differences of two at twice that, and
        # what u makes of them at six times.
        rounding = 4 * second_judge.EPS * np.abs(other.a).max()
        np.testing.assert_allclose(channel.difference, other.difference, rtol=0, atol=rounding)
        np.testing.assert_allclose(channel.u, other.u, rtol=1e-9, atol=10 * rounding)
        assert channel.verdict == other.verdict
        # One sample of two thousand may change sides where u is round-off itself.
        assert channel.coverage == pytest.approx(other.coverage, abs=1e-3)
        assert channel.rms_difference == pytest.approx(other.rms_difference, rel=1e-9, abs=rounding)
        assert channel.scale == pytest.approx(other.scale, rel=1e-14)


def test_times_that_are_not_even_take_no_sample_out_of_the_window():
    """Samples are dense at contacts: so many of them as a window holds elsewhere are a far shorter time."""
    rng = np.random.default_rng(4)
    period = 0.4
    dense = np.concatenate([at + np.arange(40) * 1e-5 for at in (0.05, 0.11, 0.31)])
    time = np.unique(np.concatenate([np.arange(401) * 1e-3, dense]))
    base = rng.normal(size=time.size)
    finer = base + 10 ** rng.uniform(-6, -2, time.size)
    runs = Runs(*(Table(pd.DataFrame({"time": time, "slider_vx": values})) for values in (base, finer)))
    u = model_uncertainty(runs, "slider_vx", period)
    near = np.abs(time[:, None] - time[None, :]) < WINDOW * period
    least = 3 * np.where(near, np.abs(base - finer)[None, :], 0.0).max(axis=1)
    assert np.all(u >= least * (1 - 1e-12))


# Another sampling of signals that are known


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("counts", [(1000, 500), (500, 1000), (1000, 997), (1009, 3000), (1000, 1000)])
def test_a_resampled_table_is_compared_alike(seed, counts):
    """Signals of six waves, known everywhere: differences are off by no more than interpolation is."""
    rng = np.random.default_rng(seed)
    waves = list(zip(rng.uniform(-1, 1, 6), 2 * np.pi * np.arange(1, 7), rng.uniform(0, 6, 6), strict=True))
    late, larger = rng.uniform(0, 2e-4), 1 + rng.uniform(0, 2e-3)

    def wave(time: np.ndarray, order: int = 0) -> np.ndarray:
        return sum(s * w**order * np.sin(w * time + p + order * np.pi / 2) for s, w, p in waves)

    def table(count: int, late: float, larger: float) -> Table:
        time = np.linspace(0, 1, count + 1)
        x, v, a = (larger * wave(time - late, order) for order in range(3))
        columns = {"slider_x": x, "slider_vx": v, "slider_ax": a}
        return Table(pd.DataFrame({"time": time} | columns))

    first, second = table(counts[0], 0.0, 1.0), table(counts[1], late, larger)
    found = compare(Runs(first), Runs(second), tolerance=1e-2)
    aligned = align(first, second, ["slider_x", "slider_vx", "slider_ax"])
    fine = np.linspace(0, 1, 20_001)
    h = 1 / max(counts)
    for order, (name, power) in enumerate((("slider_x", 4), ("slider_vx", 2), ("slider_ax", 2))):
        most = sum(abs(s) * w ** (order + power) for s, w, _ in waves)
        allowed = (1e-13 if counts[0] == counts[1] else h**power / {4: 384, 2: 8}[power]) * most * 1.01
        exact = wave(aligned.time, order) - larger * wave(aligned.time - late, order)
        channel = found.channels[name]
        np.testing.assert_allclose(channel.difference, exact, rtol=0, atol=allowed + 1e-12 * most)
        everywhere = wave(fine, order) - larger * wave(fine - late, order)
        # Sums of five hundred samples or more of waves of whole periods; the ends count twice.
        expected = norms.rms(fine, everywhere)
        assert channel.rms_difference == pytest.approx(expected, rel=1e-2, abs=allowed)
        # A wave between two samples is higher by (w h)^2 / 8 at most, h that of the compared times.
        below = (2 * np.pi * 6 / min(counts)) ** 2 / 8 * np.abs(everywhere).max() * 1.01
        assert -below - allowed <= channel.max_difference - np.abs(everywhere).max() <= allowed + 1e-12
        assert channel.rms_error <= 0.1 * expected
        if abs(np.abs(everywhere).max() / np.ptp(wave(fine, order)) - 1e-2) > 1e-3:
            beyond = np.abs(everywhere).max() > 1e-2 * np.ptp(wave(fine, order))
            assert channel.verdict == ("differ" if beyond else "agree")


def test_a_root_mean_square_is_that_over_time_however_the_samples_lie():
    even = np.linspace(0, 2, 4001)
    crowded = np.sort(np.concatenate([even[::4], 0.7 + np.arange(3000) * 1e-5]))
    whole = np.sqrt(np.trapezoid(np.exp(-4 * even), even) / 2)
    for time in (even, crowded):
        # The trapezoidal rule on half a millisecond is exact to 1e-6, the ends count twice.
        assert norms.rms(time, np.exp(-2 * time)) == pytest.approx(whole, rel=2e-3)


def test_the_scene_of_tables_that_start_late_is_told_that_they_do():
    """Beside a scene time is that of its start: an offset is refused, not compared with another part."""
    judged = random_tables(0)
    later = each(judged.a, lambda table: replace(table, frame=table.frame.assign(time=table.time + 1.0)))
    with pytest.raises(ValueError, match=r"spans 1 to .* must span 0 to"):
        compared(judged._replace(a=later))
    assert load_scene("150rpm-0.2mm").period == pytest.approx(judged.scene.period)
