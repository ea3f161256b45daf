"""Whether the settings that the paper does not print explain its figures: grid, classes, chance, page."""

from collections.abc import Hashable, Mapping, Sequence
from enum import StrEnum
from itertools import product
from math import log, nan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.ticker import ScalarFormatter

from comparison.execution.run import Progress
from comparison.execution.store import Row
from comparison.execution.tasks import SUCCESS, measure_all, on_processes
from comparison.formatting import MISSING, number, quantity
from comparison.models import platform_name
from comparison.report import svg
from comparison.scene import load_scene
from comparison.studies.as_published.runs import COORDINATES, MODEL, RATES, asked, measure
from comparison.studies.as_published.runs import figures as printed_figures
from comparison.studies.paper.runs import CENTRAL, NUDGE, PEAKS, REACH, SLIDER, scene_of
from comparison.studies.paper.runs import Config as Sampling
from comparison.studies.shared.published import published
from comparison.studies.shared.scenes import MULTIPLIERS_BDF
from comparison.studies.shared.study import Study, crossed, curves, markdown, write_csv
from comparison.tables.channels import Array

CLOSE = 0.05
"""What the paper calls insignificant moves its peaks by 0.3 % at most (Fig. 10), what it calls larger by 33 %
at least (Fig. 9): a size within 5 % is the condition's own number. Inputs are nominal here; what they leave
open is the study paper's."""
FACTOR = 2.0
"""Of the converged size, within which chance is counted: most predictions are printed that close."""
SETTING = ["tolerance", "alpha", "beta"]
PREDICTION = "prediction"
SECONDS = 1e-3
"""The reference permits a rate the error that makes its tolerance in this time (docs/model.md)."""
RELATIVE, ABSOLUTE = 1e-3, 1e-6
"""RelTol and AbsTol of ode15s where none is given (MathWorks, odeset)."""
LIMIT = 120.0
"""s, of a run; the slowest takes a tenth of it."""
SHOWN = {
    "F9-210-d": ("displacement (µm)", 1e6),
    "F7-T-v": ("velocity (mm/s)", 1e3),
    "F7-T-a": ("acceleration (m/s²)", 1.0),
}
"""Of the figure: the peaks of the central case, what they are of, and the factor of that unit."""
DISPLACEMENT = next(iter(SHOWN))
USUAL = 1e-6
"""The loosest tolerance of the study tradeoff."""
SELDOM = 0.05
"""Share of draws up to which a result is not put down to chance."""
DRAWS = 2000
"""Sets of random targets: a share of 5 % is then known to 0.5 %."""


class Config(NamedTuple):
    """How much is run."""

    sampling: Sampling  # of the ranges so many cycles; the paper has 100
    tolerances: tuple[float, ...]  # loosest first
    gains: tuple[tuple[float, float], ...]  # alpha, beta, 1/s
    starts: int  # of the converged solution, within `NUDGE`


class Cause(StrEnum):
    """What a printed figure is explained by; the first that applies."""

    CONVERGED = "the converged value"
    STARTS = "neighbouring starts"
    NUMERICS = "numerics"
    NONE = "none of these"


class Results(NamedTuple):
    """Frames of the study. A figure is that of its first id, as in the study paper; sizes have no sign."""

    config: Config
    figures: pd.DataFrame
    """A row a figure and setting: ``id``, ``scene``, ``quantity``, ``tolerance`` (m, rad), ``alpha`` and
    ``beta`` (1/s), ``status`` of the run, ``value`` (signed, in the figure's unit; nan where the run has
    none), ``error``: its size over the converged one, less 1; ``ratio``: its size over the printed one;
    ``time`` of a peak (s), ``drift``: largest violation of the constraints (m)."""
    converged: pd.DataFrame
    """A row a figure: ``id``, ``value`` of the converged solution, ``time``; ``least`` and ``most``: sizes
    from all of its starts."""
    starts: Array
    """Sizes of the converged solution, a row a figure of ``converged``, from each of its starts."""
    judged: pd.DataFrame
    """A row a figure, as `judge` returns it; its ``cause`` is a `Cause`."""
    scales: Mapping[str, float]
    """Median size of each of the slider's coordinates and rates in the central case."""
    runs: pd.DataFrame
    """A row a run: ``condition``, ``ranges``, setting, ``status``, ``message``, ``drift``."""


# ---- runs


def measured(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run every condition at every setting, and the converged solution from every start."""
    kinds = [*((name, False) for name in SLIDER), (CENTRAL, True)]
    shifts = np.linspace(0.0, NUDGE, config.starts).tolist()
    settings = [(tolerance, *gains) for tolerance, gains in product(config.tolerances, config.gains)]
    tasks = [asked(config.sampling, name, {}, ranges=r, moved=by) for name, r in kinds for by in shifts]
    tasks += [
        asked(config.sampling, name, changes(*setting), ranges=r)
        for setting, (name, r) in product(settings, kinds)
    ]
    rows = measure_all(measure, tasks, on_processes(n_jobs, LIMIT), on_progress)
    exact, tried = rows[: len(kinds) * len(shifts)], rows[len(kinds) * len(shifts) :]
    runs = pd.DataFrame(
        [
            {"condition": name, "ranges": r} | dict(zip(SETTING, setting, strict=True))
            for setting, (name, r) in product(settings, kinds)
        ]
    )
    for column in ("status", "message", "drift"):
        runs[column] = [row.get(column) for row in tried]
    converged, starts = converged_frame(exact, len(shifts))
    figures = figures_frame(runs, [row.get("values", {}) for row in tried], converged)
    scales = exact[len(shifts) * SLIDER.index(CENTRAL)]["scales"]
    return Results(config, figures, converged, starts, judge(figures, converged), scales, runs)


def changes(tolerance: float, alpha: float, beta: float) -> dict[str, object]:
    """Return what selects the paper's formulation and solver at a setting: dotted keys and values."""
    setting = {"tolerance": tolerance, "baumgarte_alpha": alpha, "baumgarte_beta": beta}
    return {**MULTIPLIERS_BDF.changes, **{f"solver.{MODEL}.{key}": value for key, value in setting.items()}}


def converged_frame(rows: Sequence[Row], count: int) -> tuple[pd.DataFrame, Array]:
    """Return the frame of the converged solution and its sizes by figure and start, ``count`` rows a run.

    `ValueError` where a first start fails: nothing can be compared then.
    """
    lines, sizes = [], []
    for same in (rows[k : k + count] for k in range(0, len(rows), count)):
        if same[0]["status"] != SUCCESS:
            raise ValueError(f"the converged solution failed: {same[0]['status']}; {same[0]['message']}")
        for name, (value, time) in same[0]["values"].items():
            each = [abs(row.get("values", {}).get(name, [nan])[0]) for row in same]
            sizes.append(each)
            line = {"id": name, "value": value, "time": time}
            lines.append(line | {"least": np.nanmin(each), "most": np.nanmax(each)})
    return pd.DataFrame(lines), np.array(sizes)


def figures_frame(
    runs: pd.DataFrame, values: Sequence[Mapping[str, Sequence[float]]], converged: pd.DataFrame
) -> pd.DataFrame:
    """Return a row a figure and setting from a row and values (id -> value and instant) a run."""
    known, of = converged.set_index("id")["value"], printed_figures()
    ranges, lines = of["quantity"].str.startswith("range_"), []
    for run, shown in zip(runs.to_dict("records"), values, strict=True):
        for name in of.index[(of["scene"] == run["condition"]) & (ranges == run["ranges"])]:
            value, time = shown.get(name, (nan, nan))
            line = {"id": name, "scene": run["condition"], "quantity": of.loc[name, "quantity"]}
            line |= {key: run[key] for key in (*SETTING, "status")}
            line |= {"value": value, "error": nan}
            line |= {"ratio": abs(value / published(str(name)).value), "time": time, "drift": run["drift"]}
            lines.append(line)
    frame = pd.DataFrame(lines)
    return frame.assign(error=(frame["value"] / frame["id"].map(known)).abs() - 1.0)


# ---- causes


def neighbourhoods(figures: pd.DataFrame) -> pd.DataFrame:
    """Return ``low`` and ``high`` sizes of each row of ``figures``, whose setting stands for its neighbours.

    From its own size to that at the next stricter tolerance of the grid with the same alpha and beta, so
    that every tolerance between them is some setting's; nan where the run has no success.
    """
    rows = figures.sort_values("tolerance", ascending=False, kind="stable")
    size = rows["value"].abs().where(rows["status"] == SUCCESS)
    stricter = size.groupby([rows["id"], rows["alpha"], rows["beta"]]).shift(-1).fillna(size)
    ends = pd.DataFrame({"low": np.minimum(size, stricter), "high": np.maximum(size, stricter)})
    return figures.join(ends)


def cause(size: float, rounding: float, converged: Mapping[Hashable, Any], low: Array, high: Array) -> Cause:
    """Return the cause of a printed size, of which half a unit of the last digit is the rounding.

    ``converged``: ``value``, ``least`` and ``most`` of the converged solution; low and high: ends of the
    `neighbourhoods`, shape (settings,).
    """
    if abs(abs(converged["value"]) - size) <= CLOSE * size:
        return Cause.CONVERGED
    # The same 5 %: what chaos explains is not put down to numerics for want of a few starts.
    if converged["least"] <= size * (1.0 + CLOSE) and converged["most"] >= size * (1.0 - CLOSE):
        return Cause.STARTS
    reached = (low <= size + rounding) & (high >= size - rounding)
    return Cause.NUMERICS if reached.any() else Cause.NONE


def judge(figures: pd.DataFrame, converged: pd.DataFrame) -> pd.DataFrame:
    """Return a row a figure: what it is explained by, and how easily it would be by chance.

    ``id``; ``cause``; ``chance``: share of the sizes within `FACTOR` of the converged one, evenly spaced in
    logarithm, that would be numerics, of those that neither the converged value nor a neighbouring start
    explains; ``settings``: how many reach it, ``agreeing``: how many of these have a peak of the printed
    sign within `REACH` of a cycle of the printed instant; ``low`` and ``high``: extreme sizes of all.
    """
    near = neighbourhoods(figures)
    lines = []
    for known in converged.to_dict("records"):
        name, own = str(known["id"]), near[near["id"] == known["id"]].dropna(subset=["low"])
        print_, (low, high) = published(name), own[["low", "high"]].to_numpy(np.float64).T
        size, rounding = abs(print_.value), print_.rounding
        targets = abs(known["value"]) * np.geomspace(1 / FACTOR, FACTOR, 1001)
        digits = rounding / size  # a target is printed to as many digits
        causes = [cause(target, digits * target, known, low, high) for target in targets]
        others = [each for each in causes if each in (Cause.NUMERICS, Cause.NONE)]
        reaching = own[(own["low"] <= size + rounding) & (own["high"] >= size - rounding)]
        away = (reaching["time"] - print_.time).abs() / load_scene(scene_of(name)).period
        lines.append(
            {
                "id": name,
                "cause": cause(size, rounding, known, low, high),
                "chance": others.count(Cause.NUMERICS) / len(others) if others else nan,
                "settings": len(reaching),
                "agreeing": int(((away <= REACH) & (reaching["value"] * print_.value > 0.0)).sum()),
                "low": own["low"].min(),
                "high": own["high"].max(),
            }
        )
    return pd.DataFrame(lines)


# ---- one setting for all


def predictions() -> list[str]:
    """Return the ids to which nothing was fitted: what was favours the converged solution."""
    of = printed_figures()
    return list(of.index[of["use"] == PREDICTION])


def met(figures: pd.DataFrame) -> pd.DataFrame:
    """Return where a setting meets a prediction within `CLOSE`: a row a setting, a column an id."""
    good = figures.assign(met=(figures["status"] == SUCCESS) & ((figures["ratio"] - 1.0).abs() <= CLOSE))
    wide = good.pivot_table("met", SETTING, "id", aggfunc="any", sort=False)
    return wide.reindex(columns=predictions(), fill_value=False).astype(bool)


def gains(sizes: Array, converged: Array, targets: Array) -> Array:
    """Return how many more targets each setting meets within `CLOSE` than the converged sizes do.

    Of those for which it has a result: a run that failed neither meets nor misses anything. ``sizes`` has
    shape (settings, figures), nan where a run has no success, ``converged`` (figures,), ``targets``
    (..., figures), the result (..., settings).
    """
    wanted = targets[..., None, :]
    hits, kept = (np.abs(each - wanted) <= CLOSE * wanted for each in (sizes, converged))
    return np.asarray(hits.sum(axis=-1) - (kept & np.isfinite(sizes)).sum(axis=-1))


def by_chance(sizes: Array, converged: Array, targets: Array, groups: Sequence[object]) -> float:
    """Return in which share of random draws the best setting gains as much as it does; see `gains`.

    A draw keeps the targets that the converged sizes meet within `CLOSE`, and puts the others anywhere else
    within `FACTOR` of them, evenly in logarithm; those of one group by the same factor.
    """
    rng, (_, of) = np.random.default_rng(0), np.unique([str(group) for group in groups], return_inverse=True)
    shape = DRAWS, int(of.max()) + 1
    factors = np.exp(rng.choice([-1.0, 1.0], shape) * rng.uniform(log(1.0 + CLOSE), log(FACTOR), shape))
    kept = np.abs(converged - targets) <= CLOSE * targets
    drawn = np.where(kept, targets, converged * factors[:, of])
    best = gains(sizes, converged, targets).max()
    return float(np.mean(gains(sizes, converged, drawn).max(axis=-1) >= best))


class Single(NamedTuple):
    """How many predictions one motion meets within `CLOSE`."""

    of: int
    converged: int
    starts: int  # the converged solution from the best of its starts
    settings: int  # with any success
    setting: tuple[float, ...]  # the best, by `gains`
    results: int  # for how many predictions it has one
    best: int  # how many of these it meets
    gain: int  # by how many the converged solution meets less of them
    chance: float  # as `by_chance`

    @property
    def surpasses(self) -> bool:
        """Whether it explains more than the converged solution does, than another start, and than chance."""
        return self.gain > max(0, self.starts - self.converged) and self.chance <= SELDOM


def single(results: Results) -> Single:
    """Return whether one setting explains more than the converged solution does; `ValueError` without any."""
    ids, known = predictions(), results.converged.set_index("id")
    targets = np.array([abs(published(name).value) for name in ids])
    good = results.figures[results.figures["status"] == SUCCESS]
    if good.empty:
        raise ValueError("no run at any setting was a success")
    wide = good.assign(size=good["value"].abs()).pivot_table("size", SETTING, "id", sort=False)
    sizes = wide.reindex(columns=ids).to_numpy(np.float64)
    converged = known.loc[ids, "value"].abs().to_numpy(np.float64)
    rows = [list(known.index).index(name) for name in ids]
    from_starts = np.abs(results.starts[rows] - targets[:, None]) <= CLOSE * targets[:, None]
    hits, gain = np.abs(sizes - targets) <= CLOSE * targets, gains(sizes, converged, targets)
    best, of = max(range(len(gain)), key=lambda k: (gain[k], hits[k].sum())), printed_figures().loc[ids]
    # Poisson's ratio moves nothing: its figures are those of the central case once more.
    groups = list(zip(of["scene"].replace("poisson-0.33", CENTRAL), of["quantity"], strict=True))
    return Single(
        of=len(ids),
        converged=int((np.abs(converged - targets) <= CLOSE * targets).sum()),
        starts=int(from_starts.sum(axis=0).max()),
        settings=len(wide),
        setting=wide.index.to_list()[best],
        results=int(np.isfinite(sizes[best]).sum()),
        best=int(hits[best].sum()),
        gain=int(gain[best]),
        chance=by_chance(sizes, converged, targets, groups),
    )


# ---- page


def _percent(share: float) -> str:
    """Return a share as percent with two digits."""
    return MISSING if np.isnan(share) else f"{number(100 * share, 2)}\u00a0%"


def ode15s(scales: Mapping[str, float]) -> pd.DataFrame:
    """Return what ode15s permits each of the slider's coordinates and rates by default in a step.

    ``permitted`` in the channel's unit; ``tolerance``: that at which the reference permits as much.
    """
    permitted = {name: max(RELATIVE * scales[name], ABSOLUTE) for name in (*COORDINATES, *RATES)}
    tolerance = {name: value * (SECONDS if name in RATES else 1.0) for name, value in permitted.items()}
    lines = {"median size": scales, "permitted": permitted, "tolerance": tolerance}
    return pd.DataFrame(lines).reindex(list(permitted)).rename_axis("channel").reset_index()


def amplification(results: Results) -> pd.DataFrame:
    """Return, a row a figure, the spread over ``starts`` and over ``settings``: most over least, less 1."""
    judged, known = results.judged.set_index("id"), results.converged.set_index("id")
    spread = {"starts": known["most"] / known["least"] - 1, "settings": judged["high"] / judged["low"] - 1}
    return pd.DataFrame(spread).rename_axis("id").reset_index()


def page(results: Results) -> dict[str, object]:
    """Return what the template asks."""
    config, one = results.config, single(results)
    judged, good = results.judged, results.figures[results.figures["status"] == SUCCESS]
    peaks = good[good["quantity"] == "peak_displacement_error"]
    usual, defaults = peaks[peaks["tolerance"] == USUAL], ode15s(results.scales)
    finest = peaks[peaks["tolerance"] == peaks["tolerance"].min()]
    spread = amplification(results)
    reached = judged[judged["cause"] == Cause.NUMERICS]
    others = judged[judged["cause"].isin([Cause.NUMERICS, Cause.NONE])]
    lines = judged.merge(results.converged, on="id").merge(printed_figures().drop(columns="value"), on="id")
    displaced = lines[lines["quantity"] == "peak_displacement_error"]
    return {
        "which": {str(each): judged[judged["cause"] == each] for each in Cause},
        "by_chance": number(others["chance"].sum(), 2),
        "close": f"{100 * CLOSE:g}",
        "nudge": quantity(NUDGE, "m", 1),
        "loosest_ended": f"{good['tolerance'].max():g}",
        "judged": lines,
        "percent": _percent,
        "config": config,
        "settings": len(config.tolerances) * len(config.gains),
        "single": one,
        "setting": f"tolerance {one.setting[0]:g}, α = {one.setting[1]:g}, β = {one.setting[2]:g}",
        "agreeing": int((reached["agreeing"] > 0).sum()),
        "reached": len(reached),
        "larger": _percent(float((peaks["error"] > 0).mean())),
        "finest": f"{finest['tolerance'].iloc[0]:g}" if len(finest) else MISSING,
        "finest_most": _percent(float(finest["error"].abs().max())),
        "usual": f"{USUAL:g}",
        "usual_median": _percent(float(usual["error"].abs().median())),
        "usual_most": _percent(float(usual["error"].abs().max())),
        "usual_runs": len(usual),
        "defaults": markdown(
            defaults, {"channel": str, "median size": number, "permitted": number, "tolerance": number}
        ),
        "strictest": number(defaults["tolerance"].min(), 1),
        "loosest": number(defaults["tolerance"].max(), 1),
        "spread": _spread(spread),
        "chaotic": ", ".join(spread[spread["starts"] >= 0.5 * spread["settings"]]["id"]) or "none",
        "below": int((displaced["size"] < displaced["low"]).sum()),
        "displaced": len(displaced),
        "by_gains": _by_gains(results),
        "statuses": _statuses(results.runs),
        "names": [str(each) for each in Cause],
        "factor": f"{FACTOR:g}",
        "central": CENTRAL,
        "whole": _whole(results),
        "unequal": _unequal(peaks),
        "made": platform_name(),
    }


def _whole(results: Results) -> str:
    """Return under which conditions all three peaks are met, by the converged solution and by settings."""
    of, known = printed_figures(), results.converged.set_index("id")["value"].abs()
    peaks = {str(scene): list(rows.index) for scene, rows in of[of["quantity"].isin(PEAKS)].groupby("scene")}
    ratios = known / [abs(published(str(name)).value) for name in known.index]
    by_setting = met(results.figures)
    exact = [scene for scene, ids in peaks.items() if ((ratios[ids] - 1.0).abs() <= CLOSE).all()]
    tried = {scene: int(by_setting[ids].all(axis=1).sum()) for scene, ids in peaks.items()}
    settings = ", ".join(f"{scene} ({count})" for scene, count in tried.items() if count)
    return (
        f"by the converged solution under {', '.join(exact) or 'no condition'}; by one setting "
        f"under {settings or 'no condition'}"
    )


def _unequal(peaks: pd.DataFrame) -> str:
    """Return by how much a peak of the displacement is another where alpha is not beta, in the median."""
    pairs = peaks[["alpha", "beta"]].drop_duplicates().to_numpy(np.float64)
    sizes = peaks.assign(size=peaks["value"].abs()).set_index(["id", "tolerance", "alpha", "beta"])["size"]
    words = []
    for alpha, beta in pairs[pairs[:, 0] != pairs[:, 1]]:
        if [beta, beta] in pairs.tolist():
            one, other = (sizes.xs((each, beta), level=("alpha", "beta")) for each in (alpha, beta))
            change = _percent(float((one / other - 1.0).abs().median()))
            words.append(f"{alpha:g}, {beta:g} against {beta:g}, {beta:g}: {change}")
    return "; ".join(words) or MISSING


def _spread(spread: pd.DataFrame) -> str:
    """Return the table of the spreads of the peaks, a row a condition."""
    peaks = spread.merge(printed_figures()[["scene", "quantity"]], left_on="id", right_index=True)
    peaks = peaks[peaks["quantity"].isin(PEAKS)]
    words = [quantity.removeprefix("peak_").removesuffix("_error") for quantity in peaks["quantity"]]
    pairs = zip(peaks["starts"], peaks["settings"], strict=True)
    cells = [f"{_percent(starts)} / {_percent(settings)}" for starts, settings in pairs]
    return crossed("condition", list(peaks["scene"]), words, cells)


def _by_gains(results: Results) -> str:
    """Return the errors of the central displacement, a row a pair of gains, a column a tolerance."""
    rows = results.figures[results.figures["id"] == DISPLACEMENT]
    cells = [
        _percent(row["error"]) if row["status"] == SUCCESS else row["status"]
        for row in rows.to_dict("records")
    ]
    gains = [f"{alpha:g}, {beta:g}" for alpha, beta in zip(rows["alpha"], rows["beta"], strict=True)]
    return crossed("α, β (1/s)", gains, [f"{each:g}" for each in rows["tolerance"]], cells)


def _statuses(runs: pd.DataFrame) -> str:
    """Return how many runs ended how, a row a tolerance."""
    counts = pd.crosstab(runs["tolerance"], runs["status"]).sort_index(ascending=False).reset_index()
    return markdown(counts, {"tolerance": "{:g}".format} | dict.fromkeys(list(counts)[1:], str))


def draw(results: Results, folder: Path) -> None:
    """Write the frames as tables, and draw the central case's peaks over the tolerance."""
    frames = {
        "figures": results.figures,
        "converged": results.converged,
        "causes": results.judged,
        "runs": results.runs,
        "settings": met(results.figures).sum(axis=1).rename("met").reset_index(),
    }
    write_csv(frames, folder, "%.6g")
    equal = [alpha for alpha, beta in results.config.gains if alpha == beta]
    looks = {
        alpha: {"label": f"α = β = {alpha:g}", "marker": "o", "ms": 3} | line
        for alpha, line in zip(equal, svg.SERIES_LINES, strict=False)
    }
    known, rows = results.converged.set_index("id"), results.figures.query("alpha == beta")
    with svg.panels(folder / "tolerances.svg", 1, len(SHOWN), height=3.6, sharex=True) as panels:
        for axes, (name, (words, factor)) in zip(panels, SHOWN.items(), strict=True):
            print_, own = published(name), rows[rows["id"] == name]
            size, rounding = factor * abs(print_.value), factor * print_.rounding
            axes.axhspan(size - rounding, size + rounding, color=svg.OUTSIDE, lw=1.2, label="printed")
            axes.axhline(
                factor * abs(known["value"][name]), color=svg.INK, lw=1.0, ls="--", label="converged"
            )
            # A run without success is a gap: what lies beyond it does not continue the curve.
            sizes = factor * own["value"].abs().where(own["status"] == SUCCESS)
            curves(
                axes, own.assign(size=sizes), "tolerance", "size", "alpha", looks,
                xscale="log", yscale="log" if name == DISPLACEMENT else "linear",
                xlabel="tolerance (m, rad)",
            )  # fmt: skip
            axes.set_title(words, fontsize=9)
        for which in (panels[0].yaxis.set_major_formatter, panels[0].yaxis.set_minor_formatter):
            which(ScalarFormatter())
        svg.legend_above(panels[0], 4)


STUDY = Study(
    "as-published",
    small=Config(
        Sampling(samples=100, long_samples=50, cycles=3),
        tolerances=(1e-6, 1e-7), gains=((0.0, 0.0), (10.0, 10.0), (5.0, 10.0)), starts=3,
    ),
    full=Config(
        Sampling(samples=10_000, long_samples=1000, cycles=3),
        tolerances=(1e-3, 1e-4, 1e-5, 5e-6, 1e-6, 3e-7, 1e-7, 1e-8, 1e-9),
        gains=(*((g, g) for g in (0.0, 1.0, 10.0, 50.0, 100.0)), (5.0, 10.0)),
        starts=64,
    ),
    measure=measured,
    page=page,
    draw=draw,
)  # fmt: skip
