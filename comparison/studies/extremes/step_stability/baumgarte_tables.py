"""The section about Baumgarte's alpha and beta: tables of steps and drift, and what follows from them."""

from __future__ import annotations

from functools import partial

import pandas as pd

from comparison.formatting import MISSING, number, quantity
from comparison.studies.extremes.step_stability.baumgarte import DEFAULT, SCENES, Run
from comparison.studies.extremes.step_stability.config import Config
from comparison.studies.extremes.step_stability.explicit import limit, longest_step
from comparison.studies.shared.frames import Columns, largest, markdown
from comparison.studies.shared.rates import rate

NO_WORSE = 3.0
"""A drift within this factor of the least counts as the least: both are round-off."""
HARMLESS = 100.0
"""1/s: larger gains can have little drift by luck alone, and are not proposed."""
STIFF = 1e3
"""1/s: from there on the error control follows the error of the constraints."""
_METRES, _SPEED = partial(quantity, unit="m"), partial(quantity, unit="m/s")


def values(config: Config, runs: pd.DataFrame) -> dict[str, object]:
    """Return what stands in the template, from the runs of `baumgarte.measured`."""
    S, loosest, most = limit(-1.0), config.tolerances[0], config.gains[-1]
    ideal, _ = SCENES
    single = runs[runs["cycles"] == 1.0]
    equal = single[single["alpha"] == single["beta"]]
    stiffest = equal[(equal["alpha"] == most) & (equal["scene"] == ideal)].set_index("tolerance")["mean_step"]
    stiff = single[single["alpha"] >= STIFF]
    loose = largest(stiff.assign(excess=stiff["position"] / stiff["tolerance"]), "excess")
    # The reference's largest step is a fiftieth of a cycle.
    fine = 0.1 * 50.0 / Run(ideal, 0.0, 0.0, loosest, 1.0).ran.period
    tables = {f"{each:g}": _steps(equal[equal["tolerance"] == each]) for each in config.tolerances}
    mapped = single[single["tolerance"] == loosest]
    return {
        "S": number(S, 4),
        "imaginary": number(limit(1j), 3),
        "steps": "\n\n".join(f"Tolerance {each}, one cycle:\n\n{shown}" for each, shown in tables.items()),
        "most": f"{most:g}",
        "shares": ", ".join(f"{number(h * most / S, 2)} at {each:g}" for each, h in stiffest.items()),
        "tolerance": f"{loosest:g}",
        "maps": "\n\n".join(f"{name}:\n\n{_map(mapped[mapped['scene'] == name])}" for name in SCENES),
        "growth": _growth(runs[runs["tolerance"] == loosest]),
        "choice": _choice(equal[equal["status"] == "success"]),
        "excess": number(loose["excess"], 2),
        "excess_at": f"alpha = {loose['alpha']:g}/s, beta = {loose['beta']:g}/s, {loose['scene']}",
        "fine": number(fine, 2),
        "default": f"{DEFAULT:g}",
        "cycles": f"{config.cycles[-1]:g}",
    }


def _steps(equal: pd.DataFrame) -> str:
    """Return both scenes' steps and drift side by side, a row a gain."""
    parts: Columns = {
        "steps": str,
        "rejected": "{:,}".format,
        "mean step h": partial(quantity, unit="s"),
        "h alpha": number,
        "largest Φ": _METRES,
        "largest Φ'": _SPEED,
    }
    ended = [
        f"{n:,}" if end == "success" else f"{n:,}: {end}" for n, end in equal[["steps", "status"]].to_numpy()
    ]
    renamed = {"mean_step": "mean step h", "position": "largest Φ", "velocity": "largest Φ'"}
    shown = equal.assign(steps=ended, **{"h alpha": equal["mean_step"] * equal["alpha"]}).rename(
        columns=renamed
    )
    wide = pd.concat(
        [shown[shown["scene"] == name].set_index("alpha").add_prefix(f"{name}: ") for name in SCENES], axis=1
    )
    wide["alpha = beta (1/s)"] = wide.index
    wide["S / alpha"] = [quantity(longest_step(gain, gain), "s") if gain else "∞" for gain in wide.index]
    columns: Columns = {"alpha = beta (1/s)": "{:g}".format, "S / alpha": str}
    return markdown(
        wide, columns | {f"{name}: {part}": write for name in SCENES for part, write in parts.items()}
    )


def _map(single: pd.DataFrame) -> str:
    """Return the drift over both gains, alpha downwards."""
    written = [
        f"{_METRES(run['position'], digits=2)}, {_SPEED(run['velocity'], digits=2)}"
        if run["status"] == "success"
        else run["status"]
        for run in single.to_dict("records")
    ]
    named = single.assign(written=written, beta=[f"beta = {beta:g}" for beta in single["beta"]])
    wide = named.pivot_table("written", "alpha", "beta", aggfunc="first", sort=False)
    columns: Columns = {"alpha (1/s)": "{:g}".format}
    return markdown(wide.rename_axis("alpha (1/s)").reset_index(), columns | dict.fromkeys(wide, str))


def _growth(runs: pd.DataFrame) -> str:
    """Return the drift over many cycles, without gains and with the default."""
    rows = []
    shown = runs[(runs["alpha"] == runs["beta"]) & runs["alpha"].isin([0.0, DEFAULT])]
    for (scene, gain), group in shown.groupby(["scene", "alpha"]):
        for part, write in (("position", _METRES), ("velocity", _SPEED)):
            order = rate(group["cycles"].tolist(), group[part].tolist())
            rows.append(
                {"scene": scene, "alpha = beta (1/s)": f"{gain:g}", "drift of": part}
                | {f"{run['cycles']:g} cycles": write(run[part]) for run in group.to_dict("records")}
                | {"order in the cycles": number(order, 2)}
            )
    return markdown(pd.DataFrame(rows))


def _choice(equal: pd.DataFrame) -> str:
    """Return which gains left the least drift, by scene and tolerance."""
    rows = []
    proposed = f"largest gain up to {HARMLESS:g}/s within {NO_WORSE:g} of the least drift"
    for (scene, tolerance), group in equal.groupby(["scene", "tolerance"], sort=False):
        least, worst = group["position"].min(), largest(group, "position")
        good = group[(group["position"] <= NO_WORSE * least) & (group["alpha"] <= HARMLESS)]
        rows.append(
            {
                "scene": scene,
                "tolerance": f"{tolerance:g}",
                proposed: f"{good['alpha'].max():g}" if len(good) else MISSING,
                "least drift": _METRES(least),
                "worst gain": f"{worst['alpha']:g} ({_METRES(worst['position'])})",
                "its steps over those without gains": f"{worst['steps'] / group['steps'].iloc[0]:.1f}",
            }
        )
    return markdown(pd.DataFrame(rows))
