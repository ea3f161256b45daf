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
from comparison.scene import Scene, SceneError, load_scene
from comparison.scene.keys import did_you_mean
from comparison.scene.schema import RandomInput
from comparison.studies.paper.runs import CENTRAL, PEAKS, Config, Draw, numbers, run_draws
from comparison.studies.shared.scenes import settable
from comparison.studies.shared.study import interval
from comparison.tables.channels import Array

SEED = 1

# ---- inputs


def inputs_of(scene: Scene) -> tuple[RandomInput, ...]:
    """Return what scatters: as the scene says, else the inputs of ``inputs.toml``.

    Raises SceneError if a key is no number of the scene, or a lognormal one is not above zero.
    """
    if not (chosen := tuple(scene.random)):
        text = files(__package__).joinpath("inputs.toml").read_text("utf-8")
        chosen = tuple(RandomInput(**entry) for entry in tomllib.loads(text)["random"])
    for one in chosen:
        value = _middle(scene, one)
        if one.distribution == "lognormal" and value <= 0:
            raise SceneError(
                f"scene {scene.name!r}: random: {label(one)} = {value:g} must be > 0 to be lognormal"
            )
    if len({label(one) for one in chosen}) < len(chosen):
        raise SceneError(f"scene {scene.name!r}: random: names a key twice")
    return chosen


def label(one: RandomInput) -> str:
    """Return the key, with its element where it has several."""
    return one.key if one.element is None else f"{one.key}[{one.element}]"


def values_at(scene: Scene, inputs: Sequence[RandomInput], u: Array) -> dict[str, object]:
    """Return the values of the keys for independent standard normal numbers u, shape (d,).

    The scene's own values are the middle of the distributions (of a lognormal one the median).
    """
    values: dict[str, Any] = {}
    for one, number in zip(inputs, u.tolist(), strict=True):
        middle = _middle(scene, one)
        if one.distribution == "normal":
            value = middle + one.deviation * number
        elif one.distribution == "lognormal":
            value = middle * exp(sqrt(log1p((one.deviation / middle) ** 2)) * number)
        else:
            value = middle + sqrt(12.0) * one.deviation * (float(norm.cdf(number)) - 0.5)
        if one.element is None:
            values[one.key] = value
        else:
            values.setdefault(one.key, [*settable(scene.data)[one.key]])[one.element] = value
    return values


def _middle(scene: Scene, one: RandomInput) -> float:
    known = settable(scene.data)
    if one.key not in known:
        hint = did_you_mean(one.key, known)
        raise SceneError(f"scene {scene.name!r}: random: {one.key!r} is not a key of a scene{hint}")
    value = known[one.key]
    if one.element is not None and isinstance(value, list) and one.element < len(value):
        value = value[one.element]
    elif one.element is not None or isinstance(value, bool) or not isinstance(value, int | float):
        raise SceneError(f"scene {scene.name!r}: random: {label(one)} is no number of a scene")
    return float(value)


# ---- draws


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> tuple[pd.DataFrame, list[str]]:
    """Draw the inputs of the central case ``config.draws`` times and run each draw by the reference.

    Returns
    -------
    tuple
        A row a draw that succeeded: largest error of the second cycle by quantity, smallest reliability
        with the scene's limits by "R of" quantity, and the standard normal number of each input by `label`;
        and the reason of each failure.
    """
    base, rows = load_scene(CENTRAL), numbers().query("scene == @CENTRAL")
    limits = {name: float(getattr(base.reliability, name).upper) for name in QUANTITIES}
    printed = rows.reset_index().drop_duplicates("quantity").set_index("quantity")["id"]
    names = dict(zip(PEAKS, QUANTITIES, strict=True))
    names |= {f"min_{name}_reliability": f"R of {name}" for name in QUANTITIES}
    inputs, ids = inputs_of(base), tuple(printed[list(names)])
    u = np.random.default_rng(SEED).normal(size=(config.draws, len(inputs)))
    changes = [values_at(base, inputs, each) for each in u]
    sampling = config._replace(draws=0)  # a draw does not depend on how many there are
    draws = [(Draw(CENTRAL, ids, sampling, limits, left_open=False, changes=each), 1) for each in changes]
    ensembles = run_draws(draws, n_jobs, on_progress)
    good = [n for n, each in enumerate(ensembles) if len(each.shown)]
    values = [ensembles[n].shown.xs("value", axis=1, level=1).iloc[0].abs().to_numpy() for n in good]
    frame = pd.DataFrame(np.reshape(values, (-1, len(names))), good, list(names.values()))
    frame[[label(one) for one in inputs]] = u[good]
    return frame, [text for each in ensembles for text in each.failures]


def summary(frame: pd.DataFrame) -> pd.DataFrame:
    """Return a row a quantity: quantiles of error and reliability, share above the limit, decisive input.

    ``rank_share``: squared rank correlation of the decisive input with the error, the largest of all inputs.
    """
    settings, inputs = load_scene(CENTRAL).reliability, frame.columns[2 * len(QUANTITIES) :]
    rows = []
    for name in QUANTITIES:
        limit = float(getattr(settings, name).upper)
        above = int((frame[name] > limit).sum())
        low, high = interval(above, len(frame))
        shares = {each: float(spearmanr(frame[each], frame[name]).statistic) ** 2 for each in inputs}
        decisive = max(shares, key=lambda each: shares[each])
        median, most = frame[name].quantile([0.5, 0.95])
        middle, least = frame[f"R of {name}"].quantile([0.5, 0.05])
        rows.append(
            {"quantity": name, "error_median": median, "error_95": most}
            | {"limit": limit, "share_above": above / len(frame), "share_low": low, "share_high": high}
            | {"R_median": middle, "R_5": least, "decisive": decisive, "rank_share": shares[decisive]}
        )
    return pd.DataFrame(rows)
