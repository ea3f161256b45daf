"""Opinion of a third engine, where installed, on a difference that the two models' own opinions leave open.

It shares no code with either model: the one with whose run it stands does not err. It is asked after the
campaign, so that the campaign's own rows are the same whether or not it is installed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from comparison.execution.run import Job, Progress, successful
from comparison.execution.store import Row
from comparison.execution.tasks import Task, measure_all, on_processes
from comparison.models import MODELS, engine_names
from comparison.scene import Scene, SceneError
from comparison.studies.campaign.adjudication import CLOSE, OPEN, Evidence, Run
from comparison.studies.campaign.opinions import excerpt
from comparison.studies.campaign.population import Case
from comparison.studies.campaign.stages import DIFFER
from comparison.studies.campaign.tables import Found
from comparison.studies.campaign.tasks import LIMIT, run_here
from comparison.tables.table import Table

ENGINE = "pinocchio"
"""That of ``examples/third_engine``."""


@dataclass(frozen=True)
class OpenTask(Task):
    """A scene whose difference is open."""

    case: Case
    adjudication: Mapping[str, Any]
    """As `comparison.studies.campaign.adjudication.adjudicate` returned it."""
    models = (*MODELS, ENGINE)


def with_third_opinions(found: Found, n_jobs: int) -> Found:
    """Return what was found, with the opinion of `ENGINE` on every open difference; as it is without it."""
    places = [
        n
        for n, (_, row) in enumerate(found)
        if row["outcome"] == DIFFER and row["adjudication"]["errs"] == OPEN
    ]
    if not places or ENGINE not in engine_names():
        return found
    tasks = [OpenTask(found[n][0], found[n][1]["adjudication"]) for n in places]
    heard = list(found)
    for n, said in zip(places, measure_all(ask_here, tasks, on_processes(n_jobs, LIMIT)), strict=True):
        case, row = found[n]
        evidence = said.get("evidence") or asdict(Evidence(ENGINE, ENGINE, (), "", said["status"]))
        heard[n] = case, row | {"adjudication": weighed(row["adjudication"], evidence)}
    return heard


def ask_here(task: OpenTask, progress: Progress) -> Row:
    """Ask the engine in this process."""
    progress(0.0)
    return {"evidence": asdict(ask(task.case.scene, task.adjudication, run_here))}


def ask(scene: Scene, open_: Mapping[str, Any], run: Run) -> Evidence:
    """Return the opinion of `ENGINE`, at the tolerance of the reference.

    Parameters
    ----------
    scene
        At the settings of the tight tier.
    open_
        The adjudication: from the sample at ``"from"`` to that at ``"until"``, judged from ``"time"`` on.
    run
        Runs a scene by a model.
    """
    runs = [_run(scene, model, run) for model in MODELS]
    first, seen, last = (int(np.abs(runs[0].time - open_[key]).argmin()) for key in ("from", "time", "until"))
    try:
        part = excerpt(scene, runs[0], first, last).with_values(
            {f"solver.{ENGINE}.tolerance": scene.data["solver"]["reference"]["tolerance"]}
        )
    except SceneError as error:
        return Evidence(ENGINE, ENGINE, (), "", f"bad input: {error}")
    outcome = run(part, ENGINE)
    if outcome.table is None:
        return Evidence(ENGINE, ENGINE, (), "", outcome.status)
    judged = slice(seen, last + 1)
    values = outcome.table.values(open_["channel"])[seen - first :]
    bases = [table.values(open_["channel"])[judged] for table in runs]
    distances = tuple(float(np.abs(values - base).max()) for base in bases)
    apart = float(np.abs(bases[0] - bases[1]).max())
    stands = [model for model, far in zip(MODELS, distances, strict=True) if far <= CLOSE * apart]
    return Evidence(ENGINE, ENGINE, distances, stands[0] if len(stands) == 1 else "", outcome.status)


def _run(scene: Scene, model: str, run: Run) -> Table:
    return successful(run(scene, model), Job(scene, model))


def weighed(open_: Mapping[str, Any], evidence: Mapping[str, Any]) -> Row:
    """Return an open adjudication with the engine's evidence: the model errs that it does not stand with."""
    stands = evidence["stands"]
    errs = next((model for model in MODELS if stands and model != stands), OPEN)
    if evidence["status"] != "success":
        said = f"{ENGINE}: {evidence['status']}"
    else:
        said = f"{ENGINE} stands with {f'the run of {stands}' if stands else 'neither'}"
    return dict(open_) | {
        "errs": errs,
        "why": f"{said}; {open_['why']}",
        "evidence": [*open_["evidence"], dict(evidence)],
    }
