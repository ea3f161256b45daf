"""Units, formats and times in which a table is written change neither verdict nor numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from judged_runs import KINDS, compared, random_scene
from scipy.io import savemat

from comparison.accuracy.uncertainty import Runs
from comparison.metrics import norms
from comparison.tables.align import align
from comparison.tables.channels import channels
from comparison.tables.foreign import read_tables
from comparison.tables.mapping import load_mapping
from comparison.tables.table import Table
from comparison.verdict.compare import compare

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


@pytest.mark.parametrize(
    ("ending", "seed", "fault"),
    [("csv", 3, 0.02), ("parquet", 2, 0.0), ("parquet", 3, 0.02), ("mat", 2, 0.0), ("txt", 3, 0.02)],
)
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
        rounding = 4 * np.finfo(float).eps * np.abs(other.a).max()
        np.testing.assert_allclose(channel.difference, other.difference, rtol=0, atol=rounding)
        np.testing.assert_allclose(channel.u, other.u, rtol=1e-9, atol=10 * rounding)
        assert channel.verdict == other.verdict
        # One sample of two thousand may change sides where u is round-off itself.
        assert channel.coverage == pytest.approx(other.coverage, abs=1e-3)
        assert channel.rms_difference == pytest.approx(other.rms_difference, rel=1e-9, abs=rounding)
        assert channel.scale == pytest.approx(other.scale, rel=1e-14)


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
