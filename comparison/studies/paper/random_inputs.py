"""Random inputs of a press, as from one built press to the next, and its errors over many draws of them."""

import tomllib
from collections.abc import Sequence
from importlib.resources import files
from math import exp, log1p, sqrt
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import norm, spearmanr

from comparison.execution.run import Progress
from comparison.reliability.errors import QUANTITIES
from comparison.scene import RandomInput, Scene, load_scene
from comparison.studies.paper.runs import CENTRAL, PEAKS, Config, Draw, numbers, run_draws
from comparison.studies.shared.scenes import settable
from comparison.studies.shared.study import interval
from comparison.tables.channels import Array

SEED = 1
_TEXT = files("comparison.studies.paper").joinpath("inputs.toml").read_text("utf-8")
INPUTS = {
    one["key"] + ("" if one.get("element") is None else f"[{one['element']}]"): RandomInput(**one)
    for one in tomllib.loads(_TEXT)["random"]
}
"""Random inputs by key, with the element where the key holds several."""


def values_at(scene: Scene, inputs: Sequence[RandomInput], u: Array) -> dict[str, object]:
    """Return the values of the keys for independent standard normal numbers u, shape (d,).

    The scene's own values are the middle of the distributions (of a lognormal one the median).
    """
    values: dict[str, Any] = {}
    for one, number in zip(inputs, u.tolist(), strict=True):
        current = settable(scene.data)[one.key]
        middle = float(current if one.element is None else current[one.element])
        if one.distribution == "normal":
            value = middle + one.deviation * number
        elif one.distribution == "lognormal":
            value = middle * exp(sqrt(log1p((one.deviation / middle) ** 2)) * number)
        else:
            value = middle + sqrt(12.0) * one.deviation * (float(norm.cdf(number)) - 0.5)
        if one.element is None:
            values[one.key] = value
        else:
            values.setdefault(one.key, [*current])[one.element] = value
    return values


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> pd.DataFrame:
    """Draw the inputs of the central case ``config.draws`` times and run each draw by the reference.

    Returns a row a draw that succeeded, by its number: largest error of the second cycle by quantity,
    smallest reliability with the scene's limits by "R of" quantity, and what was drawn, in standard normal
    numbers by the names of `INPUTS`.
    """
    base, rows = load_scene(CENTRAL), numbers().query("scene == @CENTRAL")
    limits = {name: float(getattr(base.reliability, name).upper) for name in QUANTITIES}
    printed = rows.reset_index().drop_duplicates("quantity").set_index("quantity")["id"]
    names = dict(zip(PEAKS, QUANTITIES, strict=True))
    names |= {f"min_{name}_reliability": f"R of {name}" for name in QUANTITIES}
    ids = tuple(printed[list(names)])
    u = np.random.default_rng(SEED).normal(size=(config.draws, len(INPUTS)))
    sampling = config._replace(draws=0)  # a draw does not depend on how many there are
    draws = [
        Draw(
            CENTRAL, ids, sampling, limits, left_open=False, changes=values_at(base, [*INPUTS.values()], each)
        )
        for each in u
    ]
    shown = [each.shown for each in run_draws([(one, 1) for one in draws], n_jobs, on_progress)]
    good = [n for n, each in enumerate(shown) if len(each)]
    values = [shown[n].xs("value", axis=1, level=1).iloc[0].abs().to_numpy() for n in good]
    frame = pd.DataFrame(np.reshape(values, (-1, len(names))), good, list(names.values()))
    frame[list(INPUTS)] = u[good]
    return frame


def summary(frame: pd.DataFrame) -> pd.DataFrame:
    """Return a row a quantity: quantiles of error and reliability, share above the limit, decisive input.

    ``rank_share``: squared rank correlation of the decisive input with the error, the largest of all inputs.
    """
    settings, rows = load_scene(CENTRAL).reliability, []
    for name in QUANTITIES:
        limit = float(getattr(settings, name).upper)
        above = int((frame[name] > limit).sum())
        low, high = interval(above, len(frame))
        shares = {each: float(spearmanr(frame[each], frame[name]).statistic) ** 2 for each in INPUTS}
        decisive = max(shares, key=lambda each: shares[each])
        median, most = frame[name].quantile([0.5, 0.95])
        middle, least = frame[f"R of {name}"].quantile([0.5, 0.05])
        rows.append(
            {"quantity": name, "error_median": median, "error_95": most}
            | {"limit": limit, "share_above": above / len(frame), "share_low": low, "share_high": high}
            | {"R_median": middle, "R_5": least, "decisive": decisive, "rank_share": shares[decisive]}
        )
    return pd.DataFrame(rows)
