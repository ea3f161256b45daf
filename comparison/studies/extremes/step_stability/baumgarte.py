"""Baumgarte's alpha and beta in the paper's form: what they cost in steps, and what they leave of the drift.

The error of the constraints obeys Phi'' + 2 alpha Phi' + beta^2 Phi = 0, an equation that grows stiff with
alpha and beta and that an explicit method has to follow with steps of S / |root|.
"""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from comparison.execution.run import Job, Outcome, Progress, run_all
from comparison.scene import Scene, load_scene

SCENES = {"ideal slider": "ideal", "slider with contact": "150rpm-0.2mm"}
DEFAULT = 10.0
"""1/s: of a scene, and what is shown beside no gain over many cycles."""


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
