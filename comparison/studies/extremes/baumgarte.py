"""Baumgarte's alpha and beta in the paper's form: what they cost in steps, and what they leave of the drift.

The error of the constraints obeys Phi'' + 2 alpha Phi' + beta^2 Phi = 0, an equation that grows stiff with
alpha and beta and that an explicit method has to follow with steps of S / |root|.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

from comparison.execution.run import Job, Outcome, Progress, run_all
from comparison.scene import Scene, load_scene

SCENES = {"ideal slider": "ideal", "slider with contact": "150rpm-0.2mm"}
GAINS = (0.0, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5)
"""1/s."""
TOLERANCES = (5e-6, 1e-7, 1e-10)
"""Of a step, rad and m. The loosest that the scene with contact is given: a hundredth of its clearance."""
MAPPED = TOLERANCES[0]
TURNS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
USUAL = 10.0
"""1/s: the default of a scene, and what is shown beside none over many turns."""


@dataclass(frozen=True)
class Run:
    """One run of the multiplier form.

    Attributes
    ----------
    mean_step
        s, of the steps that were accepted.
    rejected
        Steps that failed the error control.
    position, velocity
        Largest |Phi| (m, rad) and |Phi'| (m/s, rad/s).
    """

    scene: str
    alpha: float
    beta: float
    tolerance: float
    turns: float
    status: str
    steps: int
    rejected: int
    mean_step: float
    position: float
    velocity: float


def scene(name: str, alpha: float, beta: float, tolerance: float, turns: float) -> Scene:
    """Return a scene of `SCENES` in multiplier form."""
    return load_scene(
        SCENES[name],
        {
            "drive.cycles": turns,
            "output.groups": [],
            "output.samples_per_cycle": 100,
            "solver.reference.formulation": "multiplier",
            "solver.reference.tolerance": tolerance,
            "solver.reference.baumgarte_alpha": alpha,
            "solver.reference.baumgarte_beta": beta,
        },
    )


def measured(n_jobs: int, on_progress: Progress | None) -> list[Run]:
    """Run alpha = beta at all tolerances, all pairs at the loosest, and many turns with little of both."""
    keys = [(name, gain, gain, tol, 1.0) for name in SCENES for gain in GAINS for tol in TOLERANCES]
    keys += [(name, alpha, beta, MAPPED, 1.0) for name in SCENES for alpha in GAINS for beta in GAINS]
    keys += [(name, gain, gain, MAPPED, t) for name in SCENES for gain in (0.0, USUAL) for t in TURNS]
    keys = list(dict.fromkeys(keys))
    jobs = [Job(scene(*key), "reference") for key in keys]
    outcomes = run_all(jobs, n_jobs, on_progress)
    return [_run(*key, job.scene, outcome) for key, job, outcome in zip(keys, jobs, outcomes, strict=True)]


def _run(
    name: str, alpha: float, beta: float, tolerance: float, turns: float, ran: Scene, outcome: Outcome
) -> Run:
    run = outcome.table or outcome.partial
    key = (name, alpha, beta, tolerance, turns, outcome.status)
    if run is None or len(run.frame) == 0:
        return Run(*key, 0, 0, nan, nan, nan)
    counted, drift = run.provenance["counters"], run.provenance["constraints"]
    reached = ran.duration if outcome.table is not None else float(run.time[-1])
    return Run(
        *key,
        counted["steps"],
        counted["rejected"],
        reached / max(1, counted["steps"]),
        drift["position"],
        drift["velocity"],
    )


def pick(found: Sequence[Run], **wanted: object) -> list[Run]:
    """Return the runs with the attributes that are wanted, in the order of the grid."""
    chosen = [run for run in found if all(getattr(run, key) == value for key, value in wanted.items())]
    return sorted(chosen, key=lambda run: (run.turns, run.alpha, run.beta))
