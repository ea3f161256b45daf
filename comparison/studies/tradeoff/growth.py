"""How the cost of a run grows: with the cycles, the contacts and the channels that are recorded."""

from __future__ import annotations

from collections.abc import Callable
from math import isnan, nan

import pandas as pd

from comparison.execution.store import Row
from comparison.formatting import MISSING, number
from comparison.scene import Scene, load_scene
from comparison.studies.shared.formulations import MINIMAL, MULTIPLIERS, TREE, Method
from comparison.studies.shared.frames import markdown

BASE = "150rpm-0.2mm"
LENGTHS = {MINIMAL: (1.0, 10.0, 100.0, 1000.0), MULTIPLIERS: (1.0, 10.0, 100.0), TREE: (1.0, 3.0, 10.0)}
"""Method -> how many cycles it runs."""
CLEARANCES = ("90rpm-0.1mm", BASE, "300rpm-0.2mm", "90rpm-0.5mm")
GROUPS = (
    (),
    ("accelerations", "corners"),
    ("joints",),
    ("energy",),
    ("accelerations", "corners", "joints", "energy"),
)
Values = dict[str, object]
Timing = tuple[Row, Method, Scene]
FEW: Values = {"output.groups": [], "output.samples_per_cycle": 100}
"""The motion alone, sparsely."""


def growing(most: float) -> list[Timing]:
    """Return what is timed, of no run more than so many cycles: the labels of its row, method and scene."""

    def run(cycles: float, method: Method, name: str, changes: Values, **labels: str) -> Timing:
        values = {**changes, **method.changes, "drive.cycles": cycles}
        return {"cycles": cycles, **labels}, method, load_scene(name, values)

    ten, recorded = min(10.0, most), {", ".join(("motion", *of)): list(of) for of in GROUPS}
    of_cycles = ((method, cycles) for method, lengths in LENGTHS.items() for cycles in lengths)
    return [
        *(run(n, method, BASE, FEW, table="cycles") for method, n in of_cycles if n <= most),
        *(run(ten, MINIMAL, name, FEW, table="contacts", scene=name) for name in CLEARANCES),
        *(
            run(ten, MINIMAL, BASE, {"output.groups": of}, table="channels", channels=names)
            for names, of in recorded.items()
        ),
    ]


def ratio_in_long_runs(grown: pd.DataFrame) -> tuple[float, float]:
    """Return how many times the minimal formulation's cost multipliers have in the longest run of both.

    And the cycles of that run; both nan where they have none in common.
    """
    cost = grown[grown["table"] == "cycles"].pivot_table("seconds", "cycles", "method")
    both = cost.reindex(columns=[MINIMAL.title, MULTIPLIERS.title]).dropna()
    if both.empty:
        return nan, nan
    minimal, multipliers = both.iloc[-1]
    return float(multipliers / minimal), float(both.index[-1])


def tables(grown: pd.DataFrame) -> dict[str, str]:
    """Return the table of each kind of growth."""
    seconds = grown["seconds"]
    shown = grown.rename(columns={"seconds": "processor time (s)"})
    shown["a cycle (ms)"] = 1e3 * seconds / grown["cycles"]
    shown["contacts a cycle"] = grown["contacts"] / grown["cycles"]
    shown["a contact (µs)"] = 1e6 * seconds / grown["contacts"]
    whole, of_all = "{:.0f}".format, {"cycles": "{:.0f}".format, "processor time (s)": number}
    columns: dict[str, dict[str, Callable[..., str]]] = {
        "cycles": {"method": str} | of_all | {"a cycle (ms)": number, "contacts a cycle": number},
        "contacts": {"scene": str} | of_all | {"contacts": whole, "a contact (µs)": number},
        "channels": {"channels": str} | of_all,
    }
    ratio, longest = ratio_in_long_runs(grown)
    cycles = MISSING if isnan(longest) else whole(longest)
    of_kind = {name: markdown(shown[shown["table"] == name], of) for name, of in columns.items()}
    return of_kind | {"long_ratio": number(ratio, 2), "long_cycles": cycles}
