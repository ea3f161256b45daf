"""Baumgarte's alpha and beta in the paper's form: what they cost in steps, and what they leave of the drift.

The error of the constraints obeys Phi'' + 2 alpha Phi' + beta^2 Phi = 0, an equation that grows stiff with
alpha and beta and that an explicit method has to follow with steps of S / |root|.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import pandas as pd

from comparison.execution.run import Job, Outcome, Progress, run_all
from comparison.scene import Scene, load_scene
from comparison.studies.extremes.step_stability.config import Config

SCENES = {"ideal slider": "ideal", "slider with contact": "150rpm-0.2mm"}
DEFAULT = 10.0
"""1/s: of a scene, and what is shown beside no gain over many cycles."""


@dataclass(frozen=True)
class Run:
    """One run of the multiplier form, of so many cycles, in a scene of `SCENES`."""

    scene: str
    alpha: float
    beta: float
    tolerance: float
    cycles: float = 1.0

    @property
    def ran(self) -> Scene:
        """The scene with these settings."""
        return load_scene(
            SCENES[self.scene],
            {
                "drive.cycles": self.cycles,
                "output.groups": [],
                "output.samples_per_cycle": 100,
                "solver.reference.formulation": "multiplier",
                "solver.reference.tolerance": self.tolerance,
                "solver.reference.baumgarte_alpha": self.alpha,
                "solver.reference.baumgarte_beta": self.beta,
            },
        )


def measured(config: Config, n_jobs: int, on_progress: Progress | None) -> pd.DataFrame:
    """Run alpha = beta at all tolerances, all pairs at the loosest, and many cycles with little of both.

    Returns
    -------
    runs
        A row a run, with its settings, ``status``, ``steps`` that were accepted and their ``mean_step``, s,
        steps that were ``rejected`` by the error control, and the largest |Phi| as ``position`` (m, rad) and
        |Phi'| as ``velocity`` (m/s, rad/s).
    """
    gains, tolerances = config.gains, config.tolerances
    wanted = [(gain, gain, tolerance, 1.0) for gain in gains for tolerance in tolerances]
    wanted += [(alpha, beta, tolerances[0], 1.0) for alpha in gains for beta in gains]
    wanted += [(gain, gain, tolerances[0], cycles) for gain in (0.0, DEFAULT) for cycles in config.cycles]
    runs = [Run(name, *settings) for name in SCENES for settings in dict.fromkeys(wanted)]
    outcomes = run_all([Job(run.ran, "reference") for run in runs], n_jobs, on_progress)
    rows = [asdict(run) | _measure(run.ran, outcome) for run, outcome in zip(runs, outcomes, strict=True)]
    return pd.DataFrame(rows).sort_values(["cycles", "alpha", "beta"], kind="stable")


def _measure(scene: Scene, outcome: Outcome) -> dict[str, object]:
    run = outcome.table or outcome.partial
    if run is None or len(run.frame) == 0:
        return {"status": outcome.status, "steps": 0, "rejected": 0}
    counted = run.provenance["counters"]
    reached = scene.duration if outcome.table is not None else float(run.time[-1])
    return {
        "status": outcome.status,
        **{name: counted[name] for name in ("steps", "rejected")},
        "mean_step": reached / max(1, counted["steps"]),
        **{name: run.provenance["constraints"][name] for name in ("position", "velocity")},
    }
