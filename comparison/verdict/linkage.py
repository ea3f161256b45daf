"""Judgement of two models' runs of a linkage, as of any two solvers: `comparison.verdict.pair`.

Its starts are moved in the values of `initial`, as many as there are degrees of freedom, and within the
clearances.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import degrees, pi, remainder

from comparison.accuracy.levels import coarser, finer, refinement, setting_key, thresholds
from comparison.accuracy.refine import usable_table
from comparison.accuracy.uncertainty import WINDOW, clearance_scales, shift_start
from comparison.execution.run import Job, Outcome, Progress, describe
from comparison.execution.sides import Run, Side, SolverError
from comparison.models import MODELS
from comparison.reliability.assessment import has_ideal
from comparison.scene import Scene
from comparison.tables.arguments import as_source
from comparison.tables.channels import expected, known_channels
from comparison.tables.dialect import Source
from comparison.tables.mapping import Mapping
from comparison.tables.table import TableError
from comparison.verdict.pair import Demand, Pair, PairKeys, Programs, Solver, Solvers, Start
from comparison.verdict.recorded import ProgramRuns
from comparison.verdict.results import SceneComparison

_RATES = {"x": "vx", "y": "vy", "angle": "omega"}


class ModelError(SolverError):
    """A run of a model failed."""

    def __init__(self, job: Job, outcome: Outcome, run: Run) -> None:
        super().__init__(describe(job, outcome))
        kind = "moved" if any(run.start) else {0: "base", -1: "coarser"}.get(run.level, "finer")
        self.job, self.outcome, self.key = job, outcome, (job.model, kind)


@dataclass(frozen=True, kw_only=True)
class LinkagePair(Pair):
    """Two models that run a linkage."""

    scene: Scene
    launch: Callable[[Sequence[Job]], list[Outcome]]

    def job(self, run: Run) -> Job:
        """Return the job of a run: its model at its level, from a start with moved states."""
        scene, model = self.scene, run.side.label
        for _ in range(abs(run.level)):
            scene = (finer if run.level > 0 else coarser)(model, scene) or scene
        start = shift_start(scene, dict(zip(self.keys.start.states, run.start, strict=True)))
        return Job(start, model, dense=has_ideal(scene) and model in MODELS)

    def _results(self, runs: Sequence[Run], on_progress: Progress) -> list[Source | SolverError]:
        jobs = [self.job(run) for run in runs]
        results: list[Source | SolverError] = []
        for run, job, outcome in zip(runs, jobs, self.launch(jobs), strict=True):
            table = usable_table("base" if run.level >= 0 else "coarser", outcome)
            source = table and as_source(table, run.side.label)
            results.append(source if isinstance(source, Source) else ModelError(job, outcome, run))
        on_progress(1.0)  # shares are reported where the runs are launched
        return results

    def _read(self, families: Sequence[Sequence[Run]]) -> Programs:
        programs = []
        for family in families:
            sources = [source for run in family if isinstance(source := self._tables[run], Source)]
            base, finer, coarser, *perturbed = (source.companions for source in sources)
            side, rigid = family[0].side, not self.keys.start.states
            programs.append(ProgramRuns(base, finer, coarser, perturbed, (side.factor, side.order), rigid))
        _check_assembly(programs, [side.label for side in self.sides])
        return tuple(programs), ()

    def _compare(self, data: Programs, before: SceneComparison | None = None) -> SceneComparison:
        result = super()._compare(data, before)
        events = result.events if self.scene.loose else (None, None)
        return replace(result, description=self.scene.description, run_scene=self.scene, events=events)


def _check_assembly(programs: Sequence[ProgramRuns], models: Sequence[str]) -> None:
    """Raise a `TableError` if the models begin in different positions of a linkage with several."""
    first, second = (program.base.frame.iloc[0] for program in programs)
    for name in first.index.intersection(second.index):
        body, _, key = str(name).rpartition(".")
        if key == "angle" and abs(remainder(first[name] - second[name], 2 * pi)) > 1e-3:  # rad
            both = " and ".join(
                f"{degrees(angle):.6g} deg ({model})"
                for angle, model in zip((first[name], second[name]), models, strict=True)
            )
            raise TableError(
                f"the models assemble the linkage in different positions: {body} starts at {both}; state "
                f"[guess.{body}] angle_deg, also of the bodies beside it"
            )


def moved_states(scene: Scene) -> list[str]:
    """Return the channels of the initial values of a linkage, without those of a speed drive.

    A start at rest has no rates: they are those of the positions.
    """
    coordinates = {
        f"{body}.{key.removesuffix('_deg')}" for body, start in scene.data["initial"].items() for key in start
    }
    rates = {name for name in coordinates if name.rpartition(".")[2] in _RATES.values()}
    drive_body = scene.data["drive"].get("body") if "speed_rpm" in scene.data["drive"] else None
    positions = coordinates - rates - {f"{drive_body}.angle"}
    if not rates:
        rates = {f"{body}.{_RATES[key]}" for body, _, key in (name.partition(".") for name in positions)}
    return [name for name in expected(scene.data) if name in positions | rates] + [*clearance_scales(scene)]


def linkage_pair(
    scene: Scene, models: tuple[str, str], launch: Callable[[Sequence[Job]], list[Outcome]]
) -> LinkagePair:
    """Return the pair that judges two models at the standard tier; ``launch`` does the runs."""
    sides = []
    for model in models:
        settings = scene.data["solver"].get(model, {})
        kind = setting_key(model, settings)
        if kind not in settings:
            raise SolverError(f"model {model!r} has neither a tolerance nor a step in its settings")
        sides.append(Side(model, None, kind, settings[kind], *refinement(model, scene)))
    keys = PairKeys(
        side=Solvers(a=Solver(), b=Solver()),
        title=scene.title,
        start=Start(states=moved_states(scene)),
        demand=Demand(until=scene.compare.until, coverage=thresholds().coverage),
        window=WINDOW * scene.period if "speed_rpm" in scene.data["drive"] else None,
    )
    return LinkagePair(
        (sides[0], sides[1]),
        keys,
        Mapping(),
        scene.name,
        scales={name: channel.given for name, channel in known_channels(scene.data).items()}
        | clearance_scales(scene),
        scene=scene,
        launch=launch,
    )
