"""The scenes of the campaign as tasks of worker processes; each row is kept as soon as it is found."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

from comparison.cache import cache_folder
from comparison.compare import Runs
from comparison.confirmation import confirm as confirm_by_ensembles
from comparison.engines import fingerprint
from comparison.findings import SceneComparison
from comparison.ledger import Row
from comparison.machine import platform_name
from comparison.run import MODELS, Job, Outcome, Progress, RunError, kernels, runner
from comparison.scene import Scene, SceneError, digest
from comparison.sources import sources
from comparison.spread import finish, on_processes
from comparison.studies.campaign.adjudication import Run
from comparison.studies.campaign.population import Case
from comparison.studies.campaign.stages import FAILED, examine
from comparison.table import Table
from comparison.workers import Kernels, in_turn

LIMIT = 3600.0
"""s after which a scene is broken off. A model ends each of its runs at a limit of work of its own; this is
for what hangs: ten times what the dearest scene took that came to the last stage."""
SOURCES = (
    "accuracy.py", "accuracy.toml", "align.py", "attribution.py", "channels.py", "channels.toml", "check.py",
    "compare.py", "confirmation.py", "confirmation_causes.py", "confirmation_starts.py",
    "confirmation_text.py", "findings.py",
    "formulation.py", "measures/impacts.py", "measures/metrics.py", "measures/outliers.py", "resample.py",
    "run.py", "shift.py", "table.py", "thresholds.py", "thresholds.toml", "tiers.py", "uncertainty.py",
    "validation.py", "verdict.py",
    "studies/campaign/adjudication.py", "studies/campaign/opinions.py", "studies/campaign/screening.py",
    "studies/campaign/stages.py", "studies/campaign/tasks.py", "studies/campaign/walls.py",
    "studies/detection/pairs.py", "studies/detection/tasks.py",
)  # fmt: skip
"""What of this package can change a row."""
_runner = cache(runner)


@dataclass(frozen=True)
class Task:
    """A case, as `comparison.workers.in_turn` orders it."""

    case: Case

    @property
    def cost(self) -> float:
        """Expected time of its runs, s, roughly: of the tree, five where the family is asked for."""
        return Job(self.case.scene, "exudyn").cost * (5.0 if self.case.family else 1.0) * self._slowness

    @property
    def _slowness(self) -> float:
        """Time grows with the duration of a cycle, which `Job.cost` leaves out."""
        return 1.0 + self.case.scene.period

    @property
    def kernels(self) -> frozenset[Kernels]:
        """Which code is compiled for it."""
        return frozenset(kernels(self.case.scene, model) for model in MODELS)

    def key(self, fingerprints: Mapping[str, str]) -> str:
        """Hash of all that can change the row."""
        return digest(
            {
                "scene": self.case.scene.hash,
                "family": self.case.family,
                "models": dict(fingerprints),
                "sources": sources(*SOURCES),
                "machine": platform_name(),
            }
        )


def run_cases(cases: Sequence[Case], n_jobs: int, on_progress: Progress | None) -> list[Row]:
    """Examine all cases; what was examined before is not examined again.

    Returns
    -------
    rows
        In the order of the cases, as `comparison.studies.campaign.stages.examine` gives them.
    """
    prints = {model: fingerprint(model) for model in MODELS}
    tasks = {case.number: Task(case) for case in cases}
    keys = {number: task.key(prints) for number, task in tasks.items()}
    by_key = {keys[number]: task for number, task in tasks.items()}
    ordered = {key: by_key[key] for key in in_turn(by_key)}
    cache_folder().mkdir(parents=True, exist_ok=True)
    ledger = cache_folder() / "campaign.jsonl"
    rows = finish(attempt, ordered, ledger, on_processes(n_jobs, LIMIT), on_progress)
    return [_complete(rows[keys[case.number]]) for case in cases]


def attempt(task: Task, progress: Callable[[float], None]) -> Row:
    """Examine a case in this process; an error of the study's own becomes the row's reason."""
    progress(0.0)
    try:
        return examine(task.case, run_here, confirmed)
    except Exception as error:
        return {"outcome": FAILED, "reason": " ".join(f"{type(error).__name__}: {error}".split())}


def run_here(scene: Scene, model: str) -> Outcome:
    """Run a scene in this process; the model is looked up once."""
    try:
        return Outcome("success", table=_runner(model)(scene))
    except RunError as error:
        return error.outcome
    except SceneError as error:
        return Outcome("bad input", str(error))


def confirmed(result: SceneComparison, runs: tuple[Runs, Runs], scene: Scene, run: Run) -> SceneComparison:
    """Confirm a verdict "differ" by ensembles that run in this process, one after the other."""

    def tables(scenes: Sequence[Scene], model: str) -> list[Table]:
        outcomes = (run(each, model) for each in scenes)
        return [outcome.table for outcome in outcomes if outcome.table is not None]

    return confirm_by_ensembles(result, runs, scene=scene, models=MODELS, run=tables)


def _complete(row: Row) -> Row:
    """Fill a row of a scene whose process died or was broken off: it says so under "message" alone."""
    empty: Row = {"stage": "", "screening": None, "coverage": None, "breaches": {}, "failures": []} | {
        "first": None, "confirmation": None, "adjudication": None, "seconds": {}
    }  # fmt: skip
    return {"outcome": FAILED, "reason": row.get("message", "")} | empty | row
