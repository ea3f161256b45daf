"""Check of all gated runs against their baseline."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from comparison.accuracy.thresholds import thresholds_record
from comparison.accuracy.tiers import tight
from comparison.agreement.cases import Case
from comparison.execution.run import Job, Outcome, Progress, describe, run_all
from comparison.models import MODELS, platform_name, smallest_in_exudyn, versions
from comparison.regression.baseline import Baseline, RunRecord
from comparison.regression.checkpoints import settings
from comparison.regression.confirmation import Which, confirm
from comparison.regression.deviation import COUNTERS_ELSEWHERE, Finding, changes
from comparison.scene import Scene, digest, load_scene, shipped_scenes


@dataclass(frozen=True)
class Gate:
    """Results of the gate.

    Attributes
    ----------
    cases
        All checks: "failed" is a regression, "error" a run whose process died or whose model raised what it
        should not.
    notes
        Remarks about what is not a regression.
    """

    cases: list[Case]
    notes: list[str]

    @property
    def regressions(self) -> list[Case]:
        """Failed checks."""
        return [case for case in self.cases if case.status in ("failed", "error")]

    @property
    def exit_code(self) -> int:
        """0; 1 with a regression; 70 where a process died or a model raised what it should not."""
        return 70 if any(case.status == "error" for case in self.cases) else int(bool(self.regressions))


def gated_runs(scene: Scene) -> dict[Which, Job]:
    """Return the runs of a scene that have a baseline."""
    closest = tight(scene, MODELS)
    assert closest is not None  # both models are ours
    jobs = {
        ("reference", "tight"): Job(closest, "reference"),
        ("exudyn", "standard"): Job(scene, "exudyn"),
    }
    return jobs | (
        {("exudyn", "tight"): Job(closest, "exudyn")} if smallest_in_exudyn(scene.data) == "tree" else {}
    )


def gate(
    baseline: Baseline,
    scenes: Sequence[Scene],
    gone: Sequence[str] = (),
    *,
    n_jobs: int = 1,
    on_progress: Progress | None = None,
) -> Gate:
    """Run the scenes and compare them with the baseline.

    Parameters
    ----------
    baseline
        What to compare with.
    scenes
        What to run.
    gone
        Scenes of the baseline that no longer exist.
    n_jobs
        Worker processes; the result does not depend on it.
    on_progress
        Called with the finished share, 0 to 1.
    """
    planned = [
        (scene.name, which, job)
        for scene in scenes
        if scene.name in baseline.scenes
        for which, job in gated_runs(scene).items()
    ]
    outcomes = run_all([job for *_, job in planned], n_jobs, on_progress)
    ran: dict[str, dict[Which, tuple[Job, Outcome]]] = {}
    for (name, which, job), outcome in zip(planned, outcomes, strict=True):
        ran.setdefault(name, {})[which] = (job, outcome)
    elsewhere = _elsewhere(baseline)
    records = {name: baseline.scenes[name].runs for name in ran}
    notes = [*elsewhere, *confirm(ran, records, n_jobs)]
    cases = [_thresholds(baseline)]
    for name in gone:
        message = f"{baseline.scenes[name].source!r} of the baseline is neither a shipped scene nor a file"
        cases.append(_failed(name, message))
    for scene in scenes:
        if scene.name not in ran:
            cases.append(
                _failed(scene.name, "there is no baseline of it; sixbar gate SCENE --update makes one")
            )
            continue
        record = baseline.scenes[scene.name]
        if physics_hash(scene) != record.hash:
            notes.append(f"scene {scene.name!r}: its numbers are not those that the baseline was made with")
        cases += _scene(scene.name, ran[scene.name], records[scene.name], exact=not elsewhere)
    return Gate(cases, notes)


def source(scene: Scene, folder: Path) -> str:
    """Return where to find a scene again: its shipped name, or its path relative to a folder."""
    if scene.source in shipped_scenes():
        return scene.source
    return Path(os.path.relpath(Path(scene.source).expanduser(), folder)).as_posix()


def scenes_of(baseline: Baseline, folder: Path) -> tuple[list[Scene], list[str]]:
    """Load the scenes of a baseline that lies in a folder; the second list names those that no longer exist.

    Raises
    ------
    SceneError
        If one is there but cannot be used.
    """
    found, gone = [], []
    for name, record in baseline.scenes.items():
        path = folder / record.source
        if record.source in shipped_scenes():
            found.append(load_scene(record.source))
        elif path.is_file():
            found.append(load_scene(path))
        else:
            gone.append(name)
    return found, gone


def physics_hash(scene: Scene) -> str:
    """Hash of a scene's numbers without the solvers' settings, which the baseline holds itself."""
    return digest({key: part for key, part in scene.data.items() if key not in ("scene", "solver")})[:16]


def _elsewhere(baseline: Baseline) -> list[str]:
    """Describe how machine and libraries differ from those of the baseline; empty where they do not."""
    here, there, notes = versions(), baseline.versions, []
    if baseline.platform != platform_name():
        notes.append(f"the baseline was made on {baseline.platform}; this is {platform_name()}")
    if changed := [
        f"{name} {there.get(name, 'none')}, here {here.get(name, 'none')}"
        for name in {**there, **here}
        if there.get(name) != here.get(name)
    ]:
        notes.append(f"the baseline was made with {'; '.join(changed)}")
    if notes:
        notes.append(f"counters are therefore compared within {COUNTERS_ELSEWHERE:.0%} and not exactly")
    return notes


def _thresholds(baseline: Baseline) -> Case:
    """Check that the verdicts are judged by the numbers whose error rates the baseline holds."""
    if thresholds_record() == baseline.thresholds:
        return Case("thresholds", "comparison", "thresholds", "passed")
    message = (
        "comparison/accuracy/thresholds.toml is not what the baseline was made with: its numbers change only "
        "together with newly measured rates of false alarms and of detected faults"
    )
    return Case("thresholds", "comparison", "thresholds", "failed", message)


def _failed(scene: str, message: str) -> Case:
    return Case(scene, "scene", "scene", "failed", f"scene {scene!r}: {message}")


def _scene(
    scene: str,
    ran: Mapping[Which, tuple[Job, Outcome]],
    records: Mapping[Which, RunRecord],
    *,
    exact: bool,
) -> list[Case]:
    """Check all runs of a scene; what only one of the two sides has is a regression."""
    cases = []
    for which in {**ran, **records}:
        model, tier = which
        if which not in ran:
            found = [Finding("run", "failed", "the baseline has this run, the scene does not any more")]
        elif which not in records:
            message = "there is no baseline of this run; sixbar gate --update makes one"
            found = [Finding("run", "failed", message)]
        else:
            found = _outcome(*ran[which], records[which], exact=exact)
        cases += [
            Case(
                scene,
                f"{model} {tier}",
                name,
                status,
                message and f"{model} {tier}, scene {scene!r}: {message}",
            )
            for name, status, message in found
        ]
    return cases


def _outcome(job: Job, outcome: Outcome, record: RunRecord, *, exact: bool) -> list[Finding]:
    if outcome.table is None:
        crashed = outcome.status == "crashed"
        return [Finding("run", "error" if crashed else "failed", describe(job, outcome))]
    now = settings(job.scene.data, outcome.table, job.model)
    return changes(record, outcome.table, now, exact=exact)
