"""What is drawn for the ledger, and what is tried for the predictions that it does not find reproduced."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import nan
from typing import Any

import numpy as np
import pandas as pd

from comparison.execution.run import Progress
from comparison.studies.paper.draws import GROUPS, VARIANTS, Draws, Ensemble, run_draws
from comparison.studies.paper.ledger import Entry, Size, Use, events, interval, size_of
from comparison.studies.paper.runs import CENTRAL, IDEAL, PEAKS, Config, scene_of
from comparison.studies.shared.published import printed_rows
from comparison.studies.shared.study import part
from comparison.tables.channels import Array

FIRST_CYCLE = "first cycle"  # the variant that needs no run of its own
PROBED = 2  # draws that must succeed before more are run: a law may be refused, or take minutes to fail
COLUMNS = [
    "ids", "scene", "quantity", "unit", "printed", "variant", "low", "high", "draws", "size", "why",
]  # fmt: skip


def peaks_of(scene: str) -> tuple[str, ...]:
    """Return the first id of each largest error that is printed of a scene."""
    return tuple(name for name in _ids() if scene_of(name) == scene and _quantity(name) in PEAKS)


def _ids() -> list[str]:
    return [str(same.index[0]) for same in events()]


def _quantity(identifier: str) -> str:
    return str(printed_rows().loc[identifier, "quantity"])


def _is_range(identifier: str) -> bool:
    """Return whether a number is a range of many cycles, in which they are run too."""
    return _quantity(identifier).startswith("range_")


def draw_all(
    config: Config, limits: Mapping[str, float], n_jobs: int, on_progress: Progress | None
) -> tuple[dict[str, pd.DataFrame], pd.DataFrame]:
    """Draw all inputs for every printed number, and each group alone for the central largest errors.

    Returns what `Ensemble` shows by id, and `shares` of the inputs.
    """
    groups: dict[tuple[str, bool], list[str]] = {}
    for name in _ids():  # the ideal mechanism is that of the central case
        scene = CENTRAL if scene_of(name) == IDEAL else scene_of(name)
        groups.setdefault((scene, _is_range(name)), []).append(name)
    small = config._replace(samples=2 * config.long_samples)
    tasks = [
        Draws(scene, tuple(ids), small, limits, config.long_draws if many else config.draws, many)
        for (scene, many), ids in groups.items()
    ]
    central = peaks_of(CENTRAL)
    tasks += [Draws(CENTRAL, central, small, {}, config.draws, only=group) for group in GROUPS]
    ensembles = run_draws(tasks, n_jobs, on_progress)
    for task, each in zip(tasks, ensembles, strict=True):
        if each.shown.empty:
            raise ValueError(f"no draw of {task.name} succeeded: {each.failures[0]}")
    many, alone = ensembles[: len(groups)], ensembles[len(groups) :]
    drawn = {name: pd.DataFrame(each.shown[name]) for each in many for name in each.shown.columns.unique(0)}
    counted = [name for name in central if printed_rows().loc[name, "use"] != "misprint"]
    return drawn, shares(dict(zip(GROUPS, alone, strict=True)), counted)


def shares(alone: Mapping[str, Ensemble], ids: Sequence[str]) -> pd.DataFrame:
    """Return ``u_input`` of each group of inputs alone, and its share of the sum of squares."""
    rows = [
        (name, group, interval(_sizes(name, each.shown[name]["value"]), 0.0, 0.0).u_input)
        for name in ids
        for group, each in alone.items()
    ]
    frame = pd.DataFrame(rows, columns=["id", "group", "u_input"])
    squares = frame["u_input"] ** 2
    return frame.assign(share=(squares / squares.groupby(frame["id"]).transform("sum")).fillna(0.0))


def _sizes(identifier: str, values: pd.Series) -> Array:
    return np.asarray(size_of(_quantity(identifier), values), dtype=np.float64)


def missed(entries: pd.DataFrame) -> pd.DataFrame:
    """Return the predictions that are not reproduced."""
    return entries[(entries["use"] == Use.PREDICTION) & (entries["size"] == Size.OUTSIDE)]


def try_variants(
    entries: pd.DataFrame,
    drawn: Mapping[str, pd.DataFrame],
    config: Config,
    n_jobs: int,
    on_progress: Progress | None,
) -> pd.DataFrame:
    """Return a row of `COLUMNS` for each largest error or range and each variant tried for it.

    Tried for the predictions that are not reproduced, the materials for all of their largest errors. A
    variant of which one of `PROBED` draws of two cycles fails under a condition is left out, and ``why`` has
    the status of its run. Ranges are those of fewer cycles.
    """
    by_id = {entry["ids"].split(", ")[0]: entry for entry in entries.to_dict("records")}
    open_ids = [ids.split(", ")[0] for ids in missed(entries)["ids"]]
    small = config._replace(samples=2 * config.long_samples, cycles=config.fewer)
    wanted: dict[tuple[str, bool], list[str]] = {}
    for name in open_ids:
        if _quantity(name) in PEAKS or _is_range(name):
            wanted.setdefault((scene_of(name), _is_range(name)), []).append(name)
    tasks = []
    for one in VARIANTS:
        if "values" in one:
            asked = {(one["scene"], False): peaks_of(one["scene"])} if "scene" in one else wanted
            for (scene, many), ids in asked.items():
                draws = Draws(scene, tuple(ids), small, {}, config.long_draws, many, changes=one["values"])
                tasks.append((one["name"], draws))
    probed = [(variant, replace(task, count=PROBED)) for variant, task in tasks if not task.many]
    probes = run_draws([task for _, task in probed], n_jobs, part(on_progress, 0.0, 0.1))
    why: dict[str, str] = {}
    for (variant, _), probe in zip(probed, probes, strict=True):
        for text in probe.failures:
            why.setdefault(variant, text)
    runs = [task for variant, task in tasks if variant not in why]
    rest = iter(run_draws(runs, n_jobs, part(on_progress, 0.1, 1.0)))
    firsts = [name for name in open_ids if _quantity(name) in PEAKS]
    rows = [_row(by_id[name], FIRST_CYCLE, drawn[name]["first"]) for name in firsts]
    for variant, task in tasks:
        shown = None if variant in why else next(rest).shown
        for name in task.ids:
            values = pd.Series(dtype=float) if shown is None else shown[name]["value"]
            rows.append(_row(by_id[name], variant, values, why.get(variant, "")))
    return pd.DataFrame(rows, columns=COLUMNS)


def _row(entry: Entry, variant: str, values: pd.Series, why: str = "") -> dict[str, Any]:
    """Judge a printed number by the interval of a variant's draws; numerics and print are the entry's."""
    within = interval(_sizes(entry["ids"].split(", ")[0], values), entry["u_num"], entry["u_print"])
    size = Size.NONE if why else within.size(abs(entry["printed"]))
    judged = (variant, within.low, within.high, len(values), size, why)
    return {name: entry[name] for name in COLUMNS[:5]} | dict(zip(COLUMNS[5:], judged, strict=True))


def causes(entries: pd.DataFrame, tried: pd.DataFrame, numerics: pd.DataFrame) -> pd.DataFrame:
    """Return what reaches each prediction that is not reproduced, a row each by the index of ``entries``.

    ``reached_by``: the names of variants; ``variants``: how many were tried; ``settings``: at how many the
    paper's own formulation and solver gives the printed size, ``chance`` of that: those of ``numerics``, as
    `comparison.studies.as_published.study.judge` returns it; nan where it was not tried.
    """
    by_id = numerics.set_index("id").reindex(columns=["settings", "chance"])
    rows = {}
    for key, ids in missed(entries)["ids"].items():
        mine = tried[(tried["ids"] == ids) & (tried["size"] != Size.NONE)]
        name = next((each for each in ids.split(", ") if each in by_id.index), None)
        rows[key] = {
            "reached_by": list(mine["variant"][mine["size"] != Size.OUTSIDE]),
            "variants": len(mine),
            **(by_id.loc[name].to_dict() if name else dict.fromkeys(by_id, nan)),
        }
    return pd.DataFrame.from_dict(rows, orient="index", columns=["reached_by", "variants", *by_id])
