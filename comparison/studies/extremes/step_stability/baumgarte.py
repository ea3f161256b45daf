"""Baumgarte's alpha and beta in the paper's form: what they cost in steps, and what they leave of the drift.

The error of the constraints obeys Phi'' + 2 alpha Phi' + beta^2 Phi = 0, an equation that grows stiff with
alpha and beta and that an explicit method has to follow with steps of S / |root|.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import pandas as pd

from comparison.execution.run import Job, Outcome, Progress, run_all
from comparison.formatting import MISSING, number, quantity
from comparison.scene import Scene, load_scene
from comparison.studies.extremes.step_stability.explicit import limit, longest_step
from comparison.studies.shared.frames import crossed, largest, markdown, rows_table
from comparison.studies.shared.rates import rate

SCENES = {"ideal slider": "ideal", "slider with contact": "150rpm-0.2mm"}
DEFAULT = 10.0
"""1/s: of a scene, and what is shown beside no gain over many cycles."""
NO_WORSE = 3.0
"""A drift within this factor of the least counts as the least: both are round-off."""
HARMLESS = 100.0
"""1/s: larger gains can have little drift by luck alone, and are not proposed."""
STIFF = 1e3
"""1/s: from there on the error control follows the error of the constraints."""
_METRES, _SPEED = partial(quantity, unit="m"), partial(quantity, unit="m/s")


def scene(name: str, alpha: float, beta: float, tolerance: float, cycles: float) -> Scene:
    """Return a scene of `SCENES` for the multiplier form."""
    values = {
        "drive.cycles": cycles,
        "output.groups": [],
        "output.samples_per_cycle": 100,
        "solver.reference.formulation": "multiplier",
        "solver.reference.tolerance": tolerance,
        "solver.reference.baumgarte_alpha": alpha,
        "solver.reference.baumgarte_beta": beta,
    }
    return load_scene(SCENES[name], values)


def measured(
    gains: Sequence[float],
    tolerances: Sequence[float],
    cycles: Sequence[float],
    n_jobs: int,
    on_progress: Progress | None,
) -> pd.DataFrame:
    """Run alpha = beta at all tolerances, all pairs at the loosest, and many cycles with little of both.

    Returns
    -------
    runs
        A row a run, with its settings, ``status``, ``steps`` that were accepted and their ``mean_step``, s,
        steps that were ``rejected`` by the error control, and the largest |Phi| as ``position`` (m, rad) and
        |Phi'| as ``velocity`` (m/s, rad/s).
    """
    wanted = [(gain, gain, tolerance, 1.0) for gain in gains for tolerance in tolerances]
    wanted += [(alpha, beta, tolerances[0], 1.0) for alpha in gains for beta in gains]
    wanted += [(gain, gain, tolerances[0], count) for gain in (0.0, DEFAULT) for count in cycles]
    settings = [(name, *each) for name in SCENES for each in dict.fromkeys(wanted)]
    scenes = [scene(*each) for each in settings]
    outcomes = run_all([Job(each, "reference") for each in scenes], n_jobs, on_progress)
    found = [_measure(*each) for each in zip(scenes, outcomes, strict=True)]
    asked = pd.DataFrame(settings, columns=["scene", "alpha", "beta", "tolerance", "cycles"])
    return asked.join(pd.DataFrame(found)).sort_values(["cycles", "alpha", "beta"], kind="stable")


def _measure(scene: Scene, outcome: Outcome) -> dict[str, object]:
    run = outcome.table or outcome.partial
    if run is None or len(run.frame) == 0:
        return {"status": outcome.status, "steps": 0, "rejected": 0}
    counted, drift = run.provenance["counters"], run.provenance["constraints"]
    reached = scene.duration if outcome.table is not None else float(run.time[-1])
    return {
        "status": outcome.status,
        "steps": counted["steps"],
        "rejected": counted["rejected"],
        "mean_step": reached / max(1, counted["steps"]),
        "position": drift["position"],
        "velocity": drift["velocity"],
    }


def values(runs: pd.DataFrame) -> dict[str, object]:
    """Return what stands in the template, from the runs of `measured`."""
    S, most = limit(-1.0), runs["alpha"].max()
    ideal, _ = SCENES
    single = runs[runs["cycles"] == 1.0]
    equal = single[single["alpha"] == single["beta"]]
    loosest, *_ = tolerances = equal["tolerance"].unique().tolist()
    stiffest = equal[(equal["alpha"] == most) & (equal["scene"] == ideal)].set_index("tolerance")["mean_step"]
    stiff = single[single["alpha"] >= STIFF]
    loose = largest(stiff.assign(excess=stiff["position"] / stiff["tolerance"]), "excess")
    # The reference's largest step is a fiftieth of a cycle.
    fine = 0.1 * 50.0 / scene(ideal, 0.0, 0.0, loosest, 1.0).period
    tables = {f"{each:g}": _steps(equal[equal["tolerance"] == each]) for each in tolerances}
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
        "cycles": f"{runs['cycles'].max():g}",
    }


def _steps(equal: pd.DataFrame) -> str:
    """Return both scenes' steps and drift side by side, a row a gain."""
    ended = [
        f"{n:,}" if end == "success" else f"{n:,}: {end}" for n, end in equal[["steps", "status"]].to_numpy()
    ]
    parts = {
        "steps": ended,
        "rejected": equal["rejected"].map("{:,}".format),
        "mean step h": equal["mean_step"].map(partial(quantity, unit="s")),
        "h alpha": (equal["mean_step"] * equal["alpha"]).map(number),
        "largest Φ": equal["position"].map(_METRES),
        "largest Φ'": equal["velocity"].map(_SPEED),
    }
    written = pd.DataFrame(parts).set_index(equal["alpha"])
    gains = equal["alpha"].unique()
    theory = [quantity(longest_step(gain, gain), "s") if gain else "∞" for gain in gains]
    first = pd.DataFrame({"alpha = beta (1/s)": [f"{gain:g}" for gain in gains], "S / alpha": theory}, gains)
    both = [written[(equal["scene"] == name).to_numpy()].add_prefix(f"{name}: ") for name in SCENES]
    return markdown(pd.concat([first, *both], axis=1))


def _map(single: pd.DataFrame) -> str:
    """Return the drift over both gains, alpha downwards."""
    cells = [
        f"{_METRES(run['position'], digits=2)}, {_SPEED(run['velocity'], digits=2)}"
        if run["status"] == "success"
        else run["status"]
        for run in single.to_dict("records")
    ]
    alphas, betas = ([f"{gain:g}" for gain in single[name]] for name in ("alpha", "beta"))
    return crossed("alpha (1/s)", alphas, [f"beta = {beta}" for beta in betas], cells)


def _growth(runs: pd.DataFrame) -> str:
    """Return the drift over many cycles, without gains and with the default."""
    shown = runs[(runs["alpha"] == runs["beta"]) & runs["alpha"].isin([0.0, DEFAULT])]
    return rows_table(
        {"scene": str(name), "alpha = beta (1/s)": f"{gain:g}", "drift of": part}
        | {f"{cycles:g} cycles": write(drift) for cycles, drift in group[["cycles", part]].to_numpy()}
        | {"order in the cycles": number(rate(group["cycles"].tolist(), group[part].tolist()), 2)}
        for (name, gain), group in shown.groupby(["scene", "alpha"])
        for part, write in (("position", _METRES), ("velocity", _SPEED))
    )


def _choice(equal: pd.DataFrame) -> str:
    """Return which gains left the least drift, by scene and tolerance."""
    rows = []
    for (name, tolerance), group in equal.groupby(["scene", "tolerance"], sort=False):
        least, worst = group["position"].min(), largest(group, "position")
        good = group[(group["position"] <= NO_WORSE * least) & (group["alpha"] <= HARMLESS)]
        proposed = f"largest gain up to {HARMLESS:g}/s within {NO_WORSE:g} of the least drift"
        rows.append(
            {
                "scene": str(name),
                "tolerance": f"{tolerance:g}",
                proposed: f"{good['alpha'].max():g}" if len(good) else MISSING,
                "least drift": _METRES(least),
                "worst gain": f"{worst['alpha']:g} ({_METRES(worst['position'])})",
                "its steps over those without gains": f"{worst['steps'] / group['steps'].iloc[0]:.1f}",
            }
        )
    return rows_table(rows)
