"""The ledger: every printed number against both models, under each hypothesis on gravity.

A number to which the geometry, the reference line or a limit of the reliability was fitted is no prediction,
however well it is met; a number that the paper prints again is one entry. Sizes are judged after ASME V&V 20,
u_val^2 = u_num^2 + u_input^2 + u_D^2, u_D with the rounding of the print, but around the median of the draws,
on each side separately; the form of the model, u_model, is added apart. Beside every count stands what sizes
at random give.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from itertools import permutations, product
from math import exp, hypot, isnan, log, nan
from operator import eq
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import minimize_scalar

from comparison.execution.run import Progress
from comparison.models import MODELS
from comparison.scene import load_scene
from comparison.studies.paper import numerics
from comparison.studies.paper.claims import NIL
from comparison.studies.paper.identification import POWER
from comparison.studies.paper.runs import (
    CAP,
    CENTRAL,
    DATA,
    HYPOTHESES,
    IDEAL,
    INPUTS,
    PEAKS,
    PIN,
    REACH,
    VARIANTS,
    Config,
    Draw,
    Runs,
    draw_inputs,
    lack,
    measure,
    numbers,
    run_draws,
    scene_of,
)
from comparison.studies.shared.published import Published, printed_rows, published
from comparison.studies.shared.study import part
from comparison.tables.channels import Array

Entry = Mapping[Any, Any]  # a row of the ledger
Shares = tuple[float, float]

LEVEL: float = DATA["level"]
WIDE: float = DATA["wide"]
FACTOR: float = DATA["factor"]
CLOSE: float = DATA["close"]
SETS = 1000  # of random sizes: a share of 5 % is then known to 0.7 %
POISSON = "poisson-0.33"  # the central case under another Poisson's ratio
PROBES = 2  # draws that must succeed before more are run: a law may be refused, or take minutes to fail


class Use(StrEnum):
    """Use of a printed number for the models."""

    PREDICTION = "prediction"
    CALIBRATION = "calibration"
    UNINFORMATIVE = "uninformative"
    MISPRINT = "misprint"


USES = {"prediction": Use.PREDICTION, "misprint": Use.MISPRINT, "cap": Use.UNINFORMATIVE}
"""Of the table of printed numbers; all other words in it name the fit."""


class Size(StrEnum):
    """Place of the printed size beside the interval of ours."""

    INSIDE = "inside"
    WIDE = "inside, wide"  # an interval so wide that it says little
    FORM = "form"  # outside, inside with the change by the form of the model
    OUTSIDE = "outside"


class Interval(NamedTuple):
    """The interval of a size."""

    low: float
    middle: float
    high: float
    u_input: float  # half of the interval of the draws alone

    def size(self, size: float) -> Size:
        """Judge a printed size."""
        if not self.low <= size <= self.high:
            return Size.OUTSIDE
        return Size.INSIDE if self.low > 0 and self.high <= WIDE * self.low else Size.WIDE

    def powers(self, factor: float = FACTOR) -> tuple[float, float]:
        """Return the powers p of a factor, from -1 to 1, between which it holds middle * factor^p."""
        ends = [log(max(end / self.middle, 1e-300)) / log(factor) for end in (self.low, self.high)]
        return min(max(ends[0], -1.0), 1.0), min(max(ends[1], -1.0), 1.0)

    def chance(self, factor: float = FACTOR) -> float:
        """Return the share of log-uniform sizes within a factor of the middle that it holds."""
        return float(np.diff(self.powers(factor))[0]) / 2 if self.middle > 0 else nan


def interval(sizes: Array, *others: float) -> Interval:
    """Return the interval of sizes drawn, with other half-widths added in squares on each side.

    With Weibull's rule the share of further draws between two quantiles of n is as stated; the linear rule
    gives 0.91 for 0.95 of 50.
    """
    if not sizes.size:
        return Interval(nan, nan, nan, nan)
    shares = [(1 - LEVEL) / 2, 0.5, (1 + LEVEL) / 2]
    low, middle, high = np.quantile(sizes, shares, method="weibull").tolist()
    ends = middle - hypot(middle - low, *others), middle + hypot(high - middle, *others)
    return Interval(ends[0], middle, ends[1], (high - low) / 2)


def at_least(count: int, events: Iterable[Iterable[tuple[float, float]]]) -> float:
    """Return the probability of as many hits or more: `Interval.powers` that hold one number an event."""
    probabilities = np.ones(1)
    for spans in map(list, events):
        edges = np.unique([-1.0, 1.0, *np.ravel(spans)])
        middles = (edges[1:] + edges[:-1]) / 2
        hits = sum((low <= middles) & (middles <= high) for low, high in spans) + np.zeros(len(middles), int)
        probabilities = np.convolve(probabilities, np.bincount(hits, np.diff(edges) / 2))
    return float(probabilities[count:].sum())


def events(entries: pd.DataFrame) -> pd.Series:
    """Return the event of each entry: numbers of one under both Poisson's ratios differ by 0.3 %."""
    return entries["scene"].replace(POISSON, CENTRAL) + entries["quantity"]


def size_of(quantity: str, value: Any) -> Any:
    """Return the size of values of a quantity: of a reliability its distance to the cap."""
    return CAP - value if quantity.startswith("min_") else abs(value)


class Draws(NamedTuple):
    """Draws: by the first id of each printed number a frame of `Reading`, a row a draw."""

    by_hypothesis: dict[str, dict[str, pd.DataFrame]]
    forms: pd.DataFrame  # of the model, by `forms`


# ---- entries, and their judgement


def ledger(runs: Runs, draws: Draws, limits: Mapping[str, float]) -> pd.DataFrame:
    """Return a row for each printed number, in the order of the paper, by its first id.

    ``printed``, ``printed_at`` (s) as first printed; ``limit`` of the permitted error, of a reliability;
    ``bound`` (m) that geometry sets to an error of the displacement. By model its value and ``_at`` (s, deg).
    ``printed_size``, ``u_num`` with the part ``missed`` by samples, ``u_print``, ``u_D`` (nan where its
    solver was not run), ``u_model``: of that size. ``other``: as in `Reading`.
    """
    solver: dict[str, float] = {}
    if len(runs.solver):
        exact = {
            name: abs(measure(name, runs, MODELS[0], limits).value) for name in set(runs.solver["id"]) - {""}
        }
        solver = numerics.u_d(runs.solver[runs.solver["gain"] > NIL], exact)
    rows = {}
    for name, row in numbers().to_dict("index").items():
        ids, quantity, use, limit = row["ids"].split(", "), row["quantity"], row["use"], nan
        prints = [published(each) for each in ids]
        first, kind = prints[0], USES.get(use, Use.CALIBRATION)
        if quantity.startswith("min_"):
            limit = limits[quantity.split("_")[1]]
            if "displacement" in quantity and limit > abs(published("S4.2-stroke").value):
                kind = Use.UNINFORMATIVE
        readings = {model: measure(ids[0], runs, model, limits) for model in MODELS}
        sizes = {model: float(size_of(quantity, each.value)) for model, each in readings.items()}
        base, others = sizes[MODELS[0]], [sizes[model] for model in MODELS[1:]]
        if quantity in PEAKS:
            standard = {(row["scene"], MODELS[0]): [runs.standard[row["scene"], MODELS[0]]]}
            others.append(abs(measure(ids[0], replace(runs, short=standard), MODELS[0], limits).value))
        miss, size = readings[MODELS[0]].shortfall, float(size_of(quantity, first.value))
        trials = draws.forms[(draws.forms["id"] == name) & draws.forms["counts"]]
        entry = {key: row[key] for key in ("ids", "scene", "figure", "quantity", "sight")}
        entry |= {"unit": first.unit, "printed": first.value, "printed_at": first.time}
        entry |= {"use": kind, "fitted": "" if use in USES else use, "limit": limit}
        entry["note"] = "; ".join(filter(None, printed_rows().loc[ids, "note"]))
        entry["bound"] = numerics.bound(row["scene"]) if quantity == "peak_displacement_error" else nan
        entry |= {model: each.value for model, each in readings.items()}
        entry |= {f"{model}_at": each.time for model, each in readings.items()}
        entry |= {"other": readings[MODELS[0]].other, "printed_size": size, "missed": miss}
        entry |= {"u_num": max(abs(other - base) for other in others) + miss, "u_print": first.rounding}
        entry |= {"u_D": solver.get(str(name), nan) * base}
        rows[str(name)] = entry | {"u_model": float(trials["change"].abs().max()) if len(trials) else nan}
    return pd.DataFrame.from_dict(rows, orient="index")


def judge(entries: pd.DataFrame, draws: Draws) -> pd.DataFrame:
    """Return a row for each entry that is judged and each hypothesis.

    ``id``, ``hypothesis``; ``u_input``, ``low``, ``middle``, ``high`` of the size, ``size``: a `Size`;
    ``chance`` that a random size is inside; ``form_chance`` that it is so with ``u_model``; ``without``:
    whether it is inside ``low_without`` and ``high_without``, the ends without u_D; ``likely``: that with the
    corner radius in its likely range, and ``likely_chance``. ``transient``: share of the draws in which an
    end of a range is the first cycle's alone; ``later``: the largest of the draws from the second cycle on.
    """
    rows = []
    for hypothesis, frames in draws.by_hypothesis.items():
        for name, entry in entries.to_dict("index").items():
            if entry["use"] not in (Use.PREDICTION, Use.CALIBRATION):
                continue
            readings = frames[str(name)]
            sizes = size_of(entry["quantity"], readings["value"]).to_numpy(np.float64)
            bounds = interval(sizes, *_others(entry))
            form_bounds = interval(sizes, *_others(entry, "u_model"))
            size = bounds.size(entry["printed_size"])
            if size == Size.OUTSIDE and form_bounds.size(entry["printed_size"]) != Size.OUTSIDE:
                size = Size.FORM
            transient = float(((readings["other"] / readings["value"] - 1.0).abs() > CLOSE).mean())
            row = {"id": name, "hypothesis": hypothesis, **bounds._asdict()}
            row |= {"draws": len(sizes), "size": size}
            row |= {"chance": bounds.chance(), "form_chance": form_bounds.chance()}
            bounds_without = interval(sizes, *_others(entry | {"u_D": nan}))
            row |= {"without": bounds_without.size(entry["printed_size"]) != Size.OUTSIDE}
            row |= {"low_without": bounds_without.low, "high_without": bounds_without.high}
            likely_bounds = interval(sizes * _likely(entry, readings), *_others(entry | {"u_D": nan}))
            row |= {"likely": likely_bounds.size(entry["printed_size"]) != Size.OUTSIDE}
            transients = transient, float(readings["other"].abs().max())
            transients = transients if entry["quantity"].startswith("range_") else (nan, nan)
            names = "likely_chance", "transient", "later"
            rows.append(row | dict(zip(names, (likely_bounds.chance(), *transients), strict=True)))
    return pd.DataFrame(rows)


def _likely(entry: Entry, readings: pd.DataFrame) -> Any:
    """Return factors, one a draw, of an impact's peaks with the corner radius in its likely range."""
    if entry["quantity"] != "peak_acceleration_error" or entry["scene"] == PIN:
        return 1.0
    place, one = next((k, one) for k, one in enumerate(INPUTS) if "likely" in one)
    powers = [POWER * draw_inputs(int(number))[0][place] for number in readings.index]
    return (one["likely"] / one["factor"]) ** np.array(powers)


def _others(entry: Entry, *more: str) -> list[float]:
    """Return the half-widths that are known of an entry, besides that of the inputs."""
    return [entry[key] for key in ("u_num", "u_print", "u_D", *more) if not isnan(entry[key])]


def instants(entries: pd.DataFrame, draws: Draws, reach: float = REACH) -> pd.DataFrame:
    """Return a row for each printed instant or angle, each time that it is printed, and each hypothesis.

    ``at`` and ``ours``: s, or deg; ``share`` of the draws that have the printed sign within a reach of a
    cycle of it, of a reliability its angle; ``shifted``: the same of the first cycle, for the instant a
    period earlier; ``sized``: that with a size in the interval of the first cycle's sizes, too. ``random``
    and ``random_shifted``: the mean of both shares over the peaks of this quantity under the other
    conditions, by their phase: the share by chance if a printed instant belonged to one of them. `POISSON` is
    no other condition than `CENTRAL`. ``top``: 1 for an instant within a reach of the top dead centre.
    """
    rows = []
    periods = {name: load_scene(entry["scene"]).period for name, entry in entries.to_dict("index").items()}
    conditions = entries[entries["scene"] != POISSON].drop_duplicates(["scene", "quantity"])
    pairs = product(draws.by_hypothesis.items(), entries.to_dict("index").items())
    for (hypothesis, frames), (name, entry) in pairs:
        readings, period = frames[str(name)], periods[name]
        angle, shifted, sized = entry["quantity"].startswith("min_"), nan, nan
        near = 1.0 if angle else reach * period
        for identifier in entry["ids"].split(", "):
            datum = published(identifier)
            at = datum.angle if angle else datum.time
            if isnan(at):
                continue
            hits = ((readings["time"] - at).abs() <= near) & (readings["value"] * datum.value >= 0)
            if entry["quantity"] in PEAKS:
                first = readings["other"]
                early = ((readings["other_time"] + period - at).abs() <= near) & (first * datum.value > 0)
                fits = interval(first.abs().to_numpy(np.float64), *_others(entry)).size(abs(datum.value))
                shifted = float(early.mean())
                sized = shifted * (fits != Size.OUTSIDE) if entry["use"] != Use.MISPRINT else nan
            row = {key: entry[key] for key in ("scene", "quantity")} | {"id": identifier}
            row |= {"hypothesis": hypothesis, "unit": "deg" if angle else "s", "at": at}
            row |= {"ours": entry[f"{MODELS[0]}_at"], "share": float(hits.mean())}
            row |= {"shifted": shifted, "sized": sized, "printed": datum.value}
            row |= {"top": float(not angle and abs((at / period + 0.5) % 1.0 - 0.5) <= reach)}
            others = conditions[conditions["quantity"] == entry["quantity"]]
            chances = [
                _shares_at(frames[each], periods[each], datum.value, at / period, reach)
                for each in others.index[others["scene"] != str(entry["scene"]).replace(POISSON, CENTRAL)]
                if entry["quantity"] in PEAKS
            ]
            random, early_random = np.mean(chances, axis=0) if chances else (nan, nan)
            rows.append(row | {"random": random, "random_shifted": early_random})
    return pd.DataFrame(rows)


def _shares_at(readings: pd.DataFrame, period: float, datum: float, phase: float, reach: float) -> Shares:
    """Return the shares of draws with a peak of the printed sign at a phase, and at one a cycle earlier."""

    def share(value: str, time: str, delay: float) -> float:
        near = (readings[time] / period + delay - phase).abs() <= reach
        return float((near & (readings[value] * datum > 0)).mean())

    return share("value", "time", 0.0), share("other", "other_time", 1.0)


def matches_by_chance(angles: Sequence[float], ours: Sequence[float]) -> tuple[float, float]:
    """Return of all orders of the printed the mean of the equal ones, and the share with as many as now."""
    hits = sum(map(eq, angles, ours))
    share = np.mean([sum(map(eq, order, ours)) >= hits for order in permutations(angles)])
    return sum(angles.count(each) for each in ours) / len(angles), float(share)


class Joint(NamedTuple):
    """Counts of the printed sizes that one draw meets within `CLOSE` at once."""

    of: int
    draws: int
    best: int
    median: float
    random: float  # mean of the best where the printed sizes are random within `FACTOR` of our medians
    chance: float  # share of random sets of which the best meets as many or more
    numbers: tuple[str, ...]  # that the best draw meets


def joint(sizes: pd.DataFrame, printed_sizes: pd.Series, twins: Sequence[int], seed: int = 0) -> Joint:
    """Return the joint measure of drawn sizes, a row a draw, a column a printed number.

    Columns of one number in ``twins``, shape (columns,), are of one event: one random number.
    """
    values = sizes.dropna().to_numpy(np.float64)

    def hit_counts(targets: Array) -> Array:
        return np.asarray((np.abs(values - targets) <= CLOSE * targets).sum(axis=1))

    ours = hit_counts(printed_sizes.reindex(sizes.columns).to_numpy(np.float64))
    powers = np.random.default_rng(seed).uniform(-1.0, 1.0, (SETS, values.shape[1]))[:, list(twins)]
    random = np.array([hit_counts(np.median(values, axis=0) * FACTOR**power).max() for power in powers])
    best = int(ours.max())
    middle, chance = float(np.median(ours)), float((random >= best).mean())
    targets = printed_sizes.reindex(sizes.columns)
    hits = tuple(map(str, sizes.columns[np.abs(values[ours.argmax()] - targets) <= CLOSE * targets]))
    return Joint(len(sizes.columns), len(values), best, middle, float(random.mean()), chance, hits)


def joints(entries: pd.DataFrame, draws: Draws) -> dict[str, Joint]:
    """Return by hypothesis the `joint` measure of all predictions, of which those of one event are twins."""
    predictions = entries[entries["use"] == Use.PREDICTION]
    twins, result = pd.factorize(events(predictions))[0].tolist(), {}
    for name, frames in draws.by_hypothesis.items():
        sizes = pd.DataFrame({each: frames[each]["value"].abs() for each in predictions.index})
        result[name] = joint(sizes, predictions["printed_size"], twins)
    return result


# ---- the limit that the paper must have used for its reliabilities, from our errors


def printed_reliabilities() -> list[tuple[str, str, Published]]:
    """Return id, quantity and number of each smallest reliability that the paper prints."""
    quantities = printed_rows()["quantity"].str.extract(r"^min_(\w+)_reliability$", expand=False).dropna()
    return [(str(identifier), name, published(str(identifier))) for identifier, name in quantities.items()]


def one_limit(runs: Runs, quantity: str) -> float:
    """Return the upper limit that meets all printed reliabilities of a quantity best, in its unit.

    Least squares of the logarithms of the distances to the cap; a reliability printed at the cap does not
    count. The errors are those of the first model: both have the same.
    """
    pairs = [
        (CAP - datum.value, runs.reliabilities[scene_of(identifier), MODELS[0]][quantity])
        for identifier, name, datum in printed_reliabilities()
        if name == quantity and CAP - datum.value > datum.rounding
    ]

    def squares(log_limit: float) -> float:
        ours = [max(lack(exp(log_limit), assessment).max(), 1e-300) for _, assessment in pairs]
        return float(np.sum(np.log(np.array(ours) / [size for size, _ in pairs]) ** 2))

    # The sum has several minima where a limit is too narrow for any reliability; a scan finds the widest.
    scan = np.log(np.geomspace(1e-6, 1e6, 241))
    start = int(np.argmin([squares(value) for value in scan]))
    around = scan[max(start - 1, 0)], scan[min(start + 1, scan.size - 1)]
    return exp(minimize_scalar(squares, bounds=around, method="bounded").x)


# ---- draws


def draw_groups(ids: Iterable[str]) -> dict[tuple[str, bool], tuple[str, ...]]:
    """Return numbers by the scene of their draws, and True for ranges of many cycles."""
    rows = numbers().loc[list(ids)]
    scene = rows["scene"].replace(IDEAL, CENTRAL)  # the ideal mechanism is that of the central case
    many = rows["quantity"].str.startswith("range_")
    groups = rows.groupby([scene, many], sort=False)
    return {(str(name), bool(long)): tuple(group.index) for (name, long), group in groups}


def draw_all(config: Config, limits: Mapping[str, float], n_jobs: int, on_progress: Progress | None) -> Draws:
    """Draw all inputs for every printed number under each hypothesis, and forms of the model.

    `ValueError` where no draw of a condition succeeds.
    """
    groups, base = draw_groups(numbers().index), config._replace(draws=0, long_draws=0)
    tasks = [
        (Draw(scene, ids, base, limits, many, changes=changes), config.long_draws if many else config.draws)
        for changes in HYPOTHESES.values()
        for (scene, many), ids in groups.items()
    ]
    ensembles = run_draws(tasks, n_jobs, part(on_progress, 0.0, 0.7))
    for (one, _), each in zip(tasks, ensembles, strict=True):
        if each.readings.empty:
            raise ValueError(f"no draw of {one.name} succeeded: {each.failures[0]}")
    by_hypothesis = {}
    for place, name in enumerate(HYPOTHESES):
        span = slice(place * len(groups), (place + 1) * len(groups))
        by_hypothesis[name] = {
            each: pd.DataFrame(ensemble.readings[each])
            for (one, _), ensemble in zip(tasks[span], ensembles[span], strict=True)
            for each in one.ids
        }
    return Draws(by_hypothesis, forms(config, n_jobs, part(on_progress, 0.7, 1.0)))


def forms(config: Config, n_jobs: int, on_progress: Progress | None) -> pd.DataFrame:
    """Return a row for each largest error or range and each form of the model, with the same draws.

    ``id``, ``variant``, ``counts``: for u_model; ``draws``, ``median`` size, ``change``: that less the median
    of the first form in the same draws; ``why``: where a form is left out under a condition, as one of
    `PROBES` draws fails, the reason. Ranges are those of fewer cycles.
    """
    rows = numbers()
    index = rows.index[rows["quantity"].str.startswith(("peak_", "range_")) & (rows["use"] != "misprint")]
    small = config._replace(cycles=config.fewer, draws=0, long_draws=0)
    tasks = [
        (one, Draw(scene, ids, small, {}, many, changes=one["values"]))
        for one in VARIANTS
        for (scene, many), ids in draw_groups(index).items()
        if scene == one.get("scene", scene)
    ]
    probes = run_draws([(draw, PROBES) for _, draw in tasks], n_jobs, part(on_progress, 0.0, 0.2))
    draws = [
        (draw, config.long_draws)
        for (_, draw), probe in zip(tasks, probes, strict=True)
        if not probe.failures
    ]
    rest = iter(run_draws(draws, n_jobs, part(on_progress, 0.2, 1.0)))
    lines: list[dict[str, Any]] = []
    base: dict[str, pd.Series] = {}
    for (one, draw), probe in zip(tasks, probes, strict=True):
        readings = None if probe.failures else next(rest).readings
        for name in draw.ids:
            line = {"id": name, "variant": one["name"], "counts": one.get("counts", False), "draws": 0}
            line |= {"median": nan, "change": nan, "why": probe.failures[0] if probe.failures else ""}
            if readings is not None:
                sizes = readings[name]["value"].abs()
                basis = base.setdefault(name, sizes).reindex(sizes.index).median()
                line |= {"draws": len(sizes), "median": sizes.median(), "change": sizes.median() - basis}
            lines.append(line)
    return pd.DataFrame(lines)
