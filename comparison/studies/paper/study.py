"""The paper against both models: every printed number, every figure, every statement."""

from collections.abc import Mapping
from dataclasses import replace
from math import isnan
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from comparison.execution.run import Progress
from comparison.formatting import MISSING, number, quantity
from comparison.models import MODELS
from comparison.reliability.errors import QUANTITIES, unit_of
from comparison.scene import load_scene
from comparison.studies.as_published import study as as_published
from comparison.studies.paper import figures, ledger, nonlinear, runs
from comparison.studies.paper.claims import CRITERIA, Verdict, judge_all
from comparison.studies.paper.exponents import verdict
from comparison.studies.paper.ledger import Entry, Outcome, Size, Use
from comparison.studies.paper.runs import CAP, CENTRAL, DATA, INPUTS, PEAKS, REACH, VARIANTS, Runs
from comparison.studies.shared.published import printed_rows
from comparison.studies.shared.study import Study, markdown, part, rows_table, share, write_csv

OUTCOMES = (Outcome.AGREES, Outcome.DIFFERS, Outcome.VARIES, Outcome.OPEN)
SIZES = (Size.REPRODUCED, Size.WIDE, Size.OUTSIDE)
BOTH = "both partners"  # what the scenes of other materials have
MATERIALS = {one["name"] for one in VARIANTS if "scene" in one}


class Config(NamedTuple):
    """What is run: here, and by the studies nonlinear and as-published."""

    runs: runs.Config
    chaos: nonlinear.Config
    published: as_published.Config


class Results(NamedTuple):
    """What was run, and what follows from it."""

    runs: Runs
    entries: pd.DataFrame  # `ledger`
    causes: pd.DataFrame  # `ledger.causes`
    shares: pd.DataFrame  # `ledger.shares`
    tried: pd.DataFrame  # `ledger.try_variants`
    limits: pd.DataFrame  # `implied`
    statements: pd.DataFrame  # `judge_all`


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run everything and judge it."""
    best = nonlinear.measure(config.chaos, n_jobs, part(on_progress, 0.0, 0.25)).best
    central = {model: [e for key, e in best.items() if key[:2] == (CENTRAL, model)] for model in MODELS}
    made = replace(
        runs.simulate(config.runs, n_jobs, part(on_progress, 0.25, 0.5)),
        chaos=verdict(best, CENTRAL),
        exponents={model: [e.value for e in each if e.measured] for model, each in central.items()},
    )
    limits = {name: ledger.one_limit(made, name) for name in QUANTITIES}
    drawn, alone = ledger.draw_all(config.runs, limits, n_jobs, part(on_progress, 0.5, 0.8))
    entries = ledger.ledger(made, drawn, limits)
    tried = ledger.try_variants(entries, drawn, config.runs, n_jobs, part(on_progress, 0.8, 0.9))
    published = as_published.measured(config.published, n_jobs, part(on_progress, 0.9, 1.0))
    reached = ledger.causes(entries, tried, published.judged)
    return Results(made, entries, reached, alone, tried, ledger.implied(made), judge_all(made))


def page(results: Results) -> Mapping[str, object]:
    """Return what the template asks."""
    entries, settings = results.entries, load_scene(CENTRAL).reliability
    predicted, materials = entries[entries["use"] == Use.PREDICTION], _materials(results)
    fitted = entries.drop_duplicates("limit").set_index("quantity")["limit"]
    shown = results.statements.query("model == @MODELS[0] and not decides")
    limits = {name: fitted[f"min_{name}_reliability"] for name in QUANTITIES}
    peaks, statements = predicted[predicted["sign_share"].notna()], results.statements.drop_duplicates("id")
    clear = peaks[(peaks["sign"] != Outcome.OPEN) & (peaks["instant"] != Outcome.OPEN)]
    error = (predicted[f"{MODELS[0]}_ratio"] - 1.0).abs() * predicted["printed_size"]
    nominal = error <= np.sqrt((predicted[["u_num", "u_input", "u_print"]] ** 2).sum(axis=1))
    other = nominal != (predicted["size"] != Size.OUTSIDE)
    return {
        "entries": entries,
        "uses": {str(use): int((entries["use"] == use).sum()) for use in Use},
        "sizes": {str(size): predicted[predicted["size"] == size] for size in SIZES},
        "peaks": peaks,
        "clear": len(clear),
        "met": ((clear["size"] == Size.REPRODUCED) & (clear["both_share"] >= DATA["level"])).sum(),
        "nominal": nominal.sum(),
        "otherwise": ", ".join(predicted[other]["ids"].str.split(", ").str[0]) or "none",
        "outcomes": OUTCOMES,
        "table": markdown(_written(entries)),
        "missed": rows_table(map(_missed, ledger.missed(entries).join(results.causes).to_dict("records"))),
        "reached": int(results.causes["reached_by"].map(bool).sum()),
        "by_numerics": results.causes["settings"].gt(0).sum(),
        "tried_numerics": results.causes["settings"].count(),
        "chance": number(results.causes["chance"].sum(), 2),
        "variants": ", ".join(dict.fromkeys(one["name"] for one in VARIANTS)),
        "left_out": results.tried[results.tried["why"] != ""].drop_duplicates(["variant", "why"]),
        "quantities": QUANTITIES,
        "units": {name: unit_of(name) for name in QUANTITIES},
        "laws_and_codes": results.runs.laws_and_codes,
        "geometry": DATA["geometry"],
        "inputs": INPUTS,
        "shares": markdown(_shares(results.shares)),
        "largest": _largest(results.shares),
        "materials": markdown(materials),
        "held": ", ".join(
            f"{name} {rows['size'].isin([Size.REPRODUCED, Size.WIDE]).sum()} of {len(rows)}"
            for name, rows in materials.groupby("changed", sort=False)
        ),
        "statements": statements,
        "statements_table": markdown(
            statements.assign(
                verdict=statements["verdict"]
                + (": " + statements["reason"]).where(statements["reason"] != "", "")
            )[["section", "says", "verdict"]]
        ),
        "verdicts": {
            str(each): (results.statements.drop_duplicates("id")["verdict"] == each).sum() for each in Verdict
        },
        "evidence": {name: rows.to_dict("records") for name, rows in shown.groupby("id")},
        "limits": ", ".join(quantity(getattr(settings, name).upper, unit_of(name)) for name in QUANTITIES),
        "one_limit": ", ".join(quantity(limit, unit_of(name), 2) for name, limit in limits.items()),
        "reach": f"{100 * REACH:g}",
        "level": f"{100 * DATA['level']:g}",
        "wide": f"{DATA['wide']:g}",
        "config": results.runs.config,
        "central": CENTRAL,
    }


def _size(value: float, entry: Entry, digits: int = 3) -> str:
    """Write a value, or an uncertainty of one, in the unit of an entry: of a reliability as it is."""
    digits += 2 * (entry["unit"] == "deg")
    return f"{value:.{digits + 4}f}" if entry["unit"] == "1" else quantity(value, entry["unit"], digits)


def _interval(entry: Entry) -> str:
    """Write the interval of the sizes, of a reliability that of the reliability."""
    ends = [max(entry[end], 0.0) for end in ("low", "high")]
    if entry["unit"] == "1":
        ends = [CAP - end for end in reversed(ends)]
    return " … ".join(_size(end, entry) for end in ends)


def _written(entries: pd.DataFrame) -> pd.DataFrame:
    """Return the ledger as the page shows it: both models' values once where they are the same."""
    rows = []
    for entry in entries.to_dict("records"):
        judged = entry["size"] != Size.NONE
        ours = dict.fromkeys(_size(entry[model], entry) for model in MODELS)
        shares = [entry["sign_share"], entry["instant_share"]]
        rows.append(
            {
                "printed as": entry["ids"],
                "what": f"{entry['scene']}, {entry['quantity'].replace('_', ' ')}",
                "use": entry["use"] + (entry["fitted"] and f": {entry['fitted']}"),
                "printed": _size(entry["printed"], entry, 4 if entry["unit"] != "1" else 3),
                "ours": " and ".join(ours),
                "u_num": number(entry["u_num"] / entry["printed_size"], 2) if judged else "",
                "u_input": number(entry["u_input"] / entry["printed_size"], 2) if judged else "",
                "u_print": number(entry["u_print"] / entry["printed_size"], 2) if judged else "",
                "interval": _interval(entry) if judged else "",
                "size": str(entry["size"]),
                "sign / instant": "" if isnan(shares[0]) else " / ".join(map(share, shares)),
            }
        )
    return pd.DataFrame(rows)


def _missed(entry: Entry) -> dict[str, str]:
    """Return a line of a prediction that is not reproduced."""
    numerics = "not tried"
    if not isnan(entry["settings"]):
        chance = MISSING if isnan(entry["chance"]) else share(entry["chance"])
        numerics = f"{entry['settings']:g} settings (chance {chance})"
    return {
        "printed as": entry["ids"],
        "what": f"{entry['scene']}, {entry['quantity'].replace('_', ' ')}",
        "printed": _size(entry["printed"], entry, 4),
        "interval": _interval(entry),
        "reached by": ", ".join(entry["reached_by"]) or f"none of {entry['variants']:g}",
        "numerics": numerics,
    }


def _shares(shares: pd.DataFrame) -> pd.DataFrame:
    """Return the shares of the inputs in u_input of the central largest errors, a row each."""
    cells = ["< 1 %" if each < 0.01 else f"{100 * each:.0f} %" for each in shares["share"]]
    wide = shares.assign(cell=cells).pivot_table("cell", "id", "group", aggfunc="first", sort=False)
    return wide.reset_index(names="printed as")


def _largest(shares: pd.DataFrame) -> str:
    """Say which input has the largest share of each central largest error."""
    largest = shares.loc[shares.groupby("id", sort=False)["share"].idxmax()]
    quantities = printed_rows().loc[largest["id"], "quantity"].str.split("_").str[1]
    return ", ".join(f"{group} ({of})" for of, group in zip(quantities, largest["group"], strict=True))


def _materials(results: Results) -> pd.DataFrame:
    """Return how the largest errors with another material are met, by which partner has it."""
    base = results.entries[results.entries["quantity"].isin(PEAKS)].assign(variant=BOTH)
    lines = pd.concat([base, results.tried[results.tried["variant"].isin(MATERIALS)]])
    lines = lines[lines["scene"].isin({one["scene"] for one in VARIANTS if "scene" in one})]
    rows = []
    for entry in lines.sort_values(["scene", "quantity"], kind="stable").to_dict("records"):
        what = f"{entry['scene']}, {entry['quantity'].replace('_', ' ')}"
        known = {"what": what, "printed": _size(abs(entry["printed"]), entry, 4)}
        within = "" if entry["size"] == Size.NONE else _interval(entry)
        cells = {"changed": entry["variant"], "interval": within, "size": str(entry["size"])}
        rows.append(known | cells)
    return pd.DataFrame(rows)


def draw(results: Results, folder: Path) -> None:
    """Write the figures, and the long tables as CSV."""
    figures.draw(results.runs, results.entries, folder)
    times = results.entries["times"].map(lambda t: " ".join(map(str, t)))
    frames = {
        "printed": results.entries.assign(times=times).join(results.causes),
        "statements": results.statements,
        "criteria": pd.DataFrame([{"criterion": name} | each for name, each in CRITERIA.items()]),
        "limits": results.limits,
        "shares": results.shares,
        "causes": results.tried,
    }
    write_csv(frames, folder)


STUDY = Study(
    "paper",
    small=Config(
        runs.Config(samples=100, long_samples=50, cycles=4, fewer=3, members=2, draws=3, long_draws=2),
        nonlinear.STUDY.small._replace(scenes=(CENTRAL,)),
        as_published.STUDY.small,
    ),
    full=Config(
        runs.Config(
            samples=10_000, long_samples=1000, cycles=100, fewer=30, members=4, draws=200, long_draws=50
        ),
        nonlinear.STUDY.full._replace(scenes=(CENTRAL,)),
        as_published.STUDY.full,
    ),
    measure=measure,
    page=page,
    draw=draw,
    one_file=True,
)
