"""Runs of scenes by models, their outcomes and quality; the only module that starts a model."""

import platform
import traceback
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing, suppress
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import partial
from math import ceil, log10, nan

import numpy as np

from comparison.execution.pool import Death, Share, work
from comparison.execution.store import drop_unused, fetch, keep
from comparison.formatting import number, percent, quantity
from comparison.models import OURS, EngineError, code_hash, fingerprint, load, platform_name
from comparison.models import check as check_scene
from comparison.scene import Scene, SceneError, digest
from comparison.scene.loading import heavy_load
from comparison.tables.channels import expected
from comparison.tables.table import SAME_GRID, Table, TableError, check, rows

VIOLATED = "invariant-violated"
"""Status of a run that violates an invariant of its model; its table is complete but invalid."""

Progress = Callable[[float], None]


@dataclass(frozen=True)
class Job:
    """Run of a scene by a model."""

    scene: Scene
    model: str
    dense: bool = False
    """Its table has the motion at the times of `dense_scene`, too."""

    @property
    def cost(self) -> float:
        """Expected time, s, roughly: it orders the runs and weighs their progress."""
        cycles = float(self.scene.data["drive"].get("cycles", 1.0))
        settings = self.scene.data["solver"][self.model] if self.model in OURS else {}
        if self.model == "reference":
            return float(cycles * 10 ** (-log10(settings["tolerance"]) / 8 - 3))
        if settings.get("formulation") == "tree":
            return float(cycles * 10 ** (-log10(settings["tolerance"]) / 6 - 2.3))
        return float(1.4e-5 * self.scene.duration / settings["step"]) if settings else cycles


@dataclass(frozen=True)
class Outcome:
    """Outcome of a run; ``message`` is one line, a model's remedy where the status is its own.

    ``status`` is "success"; "bad input": the model refuses the scene; "crashed": the process died or the
    model raised an unforeseen error; "unusable": the table fails `comparison.tables.table.check`; or the
    model's own, such as "step-too-small". ``partial`` are unchecked results of a run that ended with such a
    status: truncated where it stopped, complete where it violated an invariant (`VIOLATED`).
    """

    status: str
    message: str = ""
    table: Table | None = None
    partial: Table | None = None
    traceback: str = ""


DENSE = 10_000
"""Least samples per crank cycle: the central case's R (acceleration) errs by 6e-7, with 1,000 by 4e-4."""
MOST_SAMPLES = 400_000  # samples of a run, some 80 MB


def dense_scene(scene: Scene) -> Scene:
    """Return a scene with at least `DENSE` samples a cycle, a whole multiple of its own."""
    output, cycles = scene.data["output"], scene.data["drive"]["cycles"]
    per_cycle = int(output["samples_per_cycle"])
    times = max(1, min(ceil(DENSE / per_cycle), int(MOST_SAMPLES / (per_cycle * cycles))))
    groups = dict.fromkeys(["accelerations", *output["groups"]])
    return scene.variant({"output.samples_per_cycle": per_cycle * times, "output.groups": list(groups)})


def at_own_samples(table: Table, scene: Scene) -> Table:
    """Return a run of `dense_scene` with the samples and channels of the scene itself, and `Table.dense`."""
    per_cycle = scene.data["output"]["samples_per_cycle"]
    stride = dense_scene(scene).data["output"]["samples_per_cycle"] // per_cycle
    names = [name for name in ("time", *expected(scene.data)) if name in table.frame]
    channels = scene.reliability.channels.values()
    frame = table.frame.loc[::stride, names].reset_index(drop=True)
    # These are the times of a run with such samples, to the last digit: an ensemble must have equal ones.
    interval = scene.period / per_cycle
    grid = np.arange(len(frame)) * interval
    if np.allclose(frame["time"], grid, rtol=0.0, atol=SAME_GRID * interval):
        frame["time"] = grid
    return replace(
        table,
        frame=frame,
        extrema={name: extremes for name, extremes in table.extrema.items() if name in names},
        provenance=table.provenance | {"scene_hash": scene.hash, "scene": scene.data},
        dense=table.frame[[name for name in ("time", *channels) if name in table.frame]],
    )


class RunError(RuntimeError):
    """A run that did not succeed, with its outcome."""

    def __init__(self, outcome: Outcome, job: Job) -> None:
        self.outcome, self.job = outcome, job
        super().__init__(outcome, job)

    def __str__(self) -> str:
        return describe(self.job, self.outcome)


def describe(job: Job, outcome: Outcome) -> str:
    """Describe in one line a run that did not succeed."""
    return f"scene {job.scene.name!r}: {failure(job.model, outcome)}"


def failure(model: str, outcome: Outcome) -> str:
    """Describe in one line, without the scene, a run that did not succeed."""
    if outcome.status == "bad input":
        return outcome.message
    return "; ".join(filter(None, (f"the {model} run did not succeed: {outcome.status}", outcome.message)))


def table_of(outcome: Outcome, job: Job) -> Table:
    """Return the table of a run; a `SceneError` if the model refused the scene, else a `RunError`."""
    if outcome.status == "bad input":
        raise SceneError(describe(job, outcome))
    if outcome.table is None:
        raise RunError(outcome, job)
    return outcome.table


def run_here(scene: Scene, model: str, progress: Progress | None = None) -> Outcome:
    """Run one scene by one model in this process; nothing is stored."""
    return _with_scene(_attempt(Job(scene, model), progress), scene)


def run_one(scene: Scene, model: str, progress: Progress | None = None) -> Table:
    """Return the table of `run_here`; errors are those of `table_of`."""
    return table_of(run_here(scene, model, progress), Job(scene, model))


def check_forces(scene: Scene, model: str) -> dict[str, float]:
    """Return the forces of `comparison.models.check`; a `SceneError` if the model refuses the scene."""
    try:
        return check_scene(model, scene.data)
    except EngineError:
        raise
    except ValueError as error:
        outcome = Outcome("bad input", " ".join(str(error).split()))
        raise SceneError(describe(Job(scene, model), outcome)) from error


def run_uncached(job: Job, on_progress: Progress | None = None) -> Outcome:
    """Run one job, the reference in this process, any other model in a worker; nothing is stored."""
    report = on_progress or (lambda _share: None)
    # The reference has no code of its own that could end its process, and runs sooner than a worker starts.
    n_jobs = 0 if job.model == "reference" else 1
    ((_, outcome),) = _outcomes([("", job)], n_jobs, lambda _key, share: report(share))
    return _with_scene(outcome, job.scene)


def run_all(jobs: Sequence[Job], n_jobs: int, on_progress: Progress | None = None) -> list[Outcome]:
    """Run many scenes, equal ones once; stored runs are used, and each successful one is stored as it ends.

    Outcomes are in the order of the jobs; an unknown model is an `EngineError`. ``n_jobs`` worker processes
    are spawned: a script needs ``if __name__ == "__main__":``; with 0 of them all runs are of this process.
    """
    fingerprints = {model: fingerprint(model) for model in {job.model for job in jobs}}
    keys = [run_key(job, fingerprints[job.model]) for job in jobs]
    by_key = dict(zip(keys, jobs, strict=True))
    outcomes = {key: Outcome("success", table=table) for key in by_key if (table := fetch(key)) is not None}
    shares = {key: float(key in outcomes) for key in by_key}
    total = sum(job.cost for job in by_key.values())

    def report(key: str, share: float) -> None:
        shares[key] = share
        if on_progress:
            on_progress(sum(by_key[key].cost * share for key, share in shares.items()) / total)

    drop_unused()
    queue = _in_order({key: job for key, job in by_key.items() if key not in outcomes})
    with closing(_outcomes(queue, n_jobs, report)) as results:
        for key, outcome in results:
            outcomes[key] = outcome
            if outcome.table is not None:
                keep(key, outcome.table)
            report(key, 1.0)
    return [_with_scene(outcomes[key], job.scene) for key, job in zip(keys, jobs, strict=True)]


def run_key(job: Job, fingerprint: str) -> str:
    """Return the hash of everything that can change a run by a model of this fingerprint."""
    solver = job.scene.data["solver"]
    return digest(
        {
            "scene": {key: part for key, part in job.scene.data.items() if key not in ("scene", "solver")},
            "solver": solver[job.model] if job.model in OURS else solver,  # another may build on ours
            "model": job.model,
            "dense": job.dense and job.scene.reliability.channels,
            "fingerprint": fingerprint,
            "code": code_hash(__name__),
            "python": platform.python_version(),
            "machine": platform_name(),  # a CI service restores a cache elsewhere
        }
    )


def _code(job: Job) -> tuple[object, ...]:
    """Return a key of the code that a run of our models compiles."""
    return job.model, job.scene.data["solver"].get(job.model, {}).get("formulation"), job.scene.loose


def _in_order(jobs: Mapping[str, Job]) -> list[tuple[str, Job]]:
    """Order jobs: one of each `_code`, the reference's ahead, then the others; the longest first."""
    longest = sorted(jobs, key=lambda key: (-jobs[key].cost, key))
    first = {_code(jobs[key]): key for key in reversed(longest)}
    ahead = sorted(first.values(), key=lambda key: (jobs[key].model != "reference", longest.index(key)))
    return [(key, jobs[key]) for key in dict.fromkeys((*ahead, *longest))]


def _outcomes(
    jobs: Sequence[tuple[str, Job]], n_jobs: int, on_share: Callable[[str, float], None]
) -> Generator[tuple[str, Outcome]]:
    """Run jobs in ``n_jobs`` workers, with 0 in this process, and yield each outcome when its job ends."""
    if not n_jobs:
        yield from ((key, _attempt(job, partial(on_share, key))) for key, job in jobs)
        return
    groups = {key: _code(job) for key, job in jobs if job.model in OURS}
    with closing(work(_attempt, jobs, n_jobs, groups=groups)) as events:
        for key, event in events:
            if isinstance(event, Share):
                on_share(key, event.value)
            else:
                yield key, Outcome("crashed", event.words) if isinstance(event, Death) else event


def _attempt(job: Job, progress: Progress | None) -> Outcome:
    """Run a job and check its table; any exception of a model becomes an outcome."""
    scene = dense_scene(job.scene) if job.dense else job.scene
    try:
        # A copy: modifications of the scene by a model must not enter the table's record.
        result = load(job.model)(deepcopy(scene.data), progress=progress)
        table = Table.from_result(result)
        if "clearance" not in scene.data:  # a linkage without contacts
            table = replace(table, events=None)
        if result.status == "success":
            candidate = table.with_record({"scene": scene.data})
            check(candidate, expected(scene.data), (0.0, scene.duration), name=f"the {job.model} run")
        if job.dense:
            table = at_own_samples(table, job.scene)
        if result.status != "success":
            remedy = "; ".join(filter(None, (result.remedy, _load_line(job))))
            return Outcome(result.status, remedy, partial=table)
    except TableError as error:
        return Outcome("unusable", str(error))
    except ValueError as error:
        return Outcome("bad input", " ".join(str(error).split()))
    except Exception as error:
        message = " ".join(f"{type(error).__name__}: {error}".split())
        return Outcome("crashed", message, traceback=traceback.format_exc())
    return Outcome("success", table=table)


def _load_line(job: Job) -> str:
    """Return a line if the load of a run that failed is absurd."""
    with suppress(ValueError):  # the check of a model may contradict its run
        return heavy_load(job.scene.data, check_scene(job.model, job.scene.data))
    return ""


def _with_scene(outcome: Outcome, scene: Scene) -> Outcome:
    """Record the complete scene in the tables, so that `sixbar compare` finds it beside them."""
    record = {"scene_hash": scene.hash, "scene": scene.data}
    whole, part = (table and table.with_record(record) for table in (outcome.table, outcome.partial))
    return replace(outcome, table=whole, partial=part)


# ---- quality of a finished run: resolution of contacts, spurious energy, constraints, indentation

FEW_STEPS = 10.0
"""Required steps per contact: with fewer its impulse depends on its start in a step (docs/accuracy.md)."""
MUCH_ENERGY = 0.01
"""Permitted spurious energy over the dissipated, which half a percent of the restitution changes as much."""
MUCH_DRIFT = 1e-6
"""Permitted violation of constraints, m or rad: the depth of contacts of steel; of rates a thousandfold."""


def steps_per_contact(table: Table) -> float:
    """Return steps per contact, their median weighted by peak force; nan without contacts or a fixed step."""
    step, contacts = table.provenance.get("settings", {}).get("step_used"), table.contacts
    if step is None or contacts is None or not rows(contacts):
        return nan
    lengths = np.asarray(contacts["end"] - contacts["start"], dtype=np.float64)
    forces = np.asarray(contacts["peak_force"], dtype=np.float64)
    if not forces.sum() > 0.0:
        return nan
    # Long contacts with little force must not offset short impacts.
    return float(np.quantile(lengths, 0.5, weights=forces, method="inverted_cdf")) / float(step)


def energy_share(table: Table) -> float:
    """Return the largest spurious energy over the dissipated, else over the kinetic; nan if not recorded."""
    if "energy_residual" not in table.names or not len(table.time):
        return nan
    losses = [name for name in ("energy_damping", "energy_friction") if name in table.names]
    loss = float(sum(table.values(name)[-1] for name in losses))
    base = loss if loss > 0.0 else float(table.values("energy_kinetic").max())
    return float(np.abs(table.values("energy_residual")).max()) / base if base > 0.0 else nan


def contact_warnings(table: Table) -> list[str]:
    """Return a line if a measure of a contact is zero in every contact: the model does not record it."""
    events = table.contacts
    if events is None or not (count := rows(events)):
        return []
    measures = ("normal_speed", "impulse", "peak_force", "largest_depth")
    zero = [name for name in measures if name in events and not np.any(events[name])]
    line = f"{', '.join(zero)} of all its {count} contacts are zero: these are not recorded, it seems"
    return [line] if zero else []


def quality_warnings(table: Table) -> list[str]:
    """Return one line for each quality check that a finished run fails."""
    lines = []
    if (steps := steps_per_contact(table)) < FEW_STEPS:
        tree = ", or use solver.exudyn.formulation = 'tree'"
        lines.append(
            f"half of its contacts, weighted by force, last less than {number(steps, 2)} steps; accurate "
            f"impulses require at least {FEW_STEPS:g}: reduce solver.exudyn.step"
            f"{tree * ('body' not in table.provenance.get('scene', {}))}"
        )
    if (share := energy_share(table)) > MUCH_ENERGY:
        lines.append(f"spurious energy is {percent(share)} of the dissipated energy: refine the solver")
    drift = table.provenance.get("constraints", {})
    position, velocity = drift.get("position", 0.0), drift.get("velocity", 0.0)
    if position > MUCH_DRIFT or velocity > 1e3 * MUCH_DRIFT:
        lines.append(
            f"its constraints are violated by up to {quantity(position, 'm')}, {quantity(velocity, 'm/s')}: "
            "refine the solver, and keep Baumgarte's gains below a tenth of one over its largest step"
        )
    lines += contact_warnings(table)
    return lines + deep_contacts(table)


def deep_contacts(table: Table) -> list[str]:
    """Return a line for the first clearance in which a contact is deeper than its radius."""
    scene, contacts = table.provenance.get("scene", {}), table.contacts
    if contacts is None or "contact" not in scene:
        return []
    radii = {"contact.corner_radius": scene["contact"].get("corner_radius", np.inf)}
    for name, clearance in scene["clearance"].items() if "body" in scene else ():
        key = "corner_radius" if "corner_radius" in clearance else "journal_radius"
        radii[f"clearance.{name}.{key}"] = clearance[key]
    places = np.array([str(corner).partition(".")[0] for corner in contacts["corner"]])
    for key, radius in radii.items():
        here = places == key.split(".")[1] if key.startswith("clearance.") else places != "pin"
        depth = float(np.asarray(contacts["largest_depth"])[here].max(initial=0.0))
        if depth > radius:
            what = "a journal" if key.endswith("journal_radius") else "a corner"
            rule = f"deeper than its radius {key} = {radius:g} m: the contact law is not valid there"
            return [f"{what} is pressed {quantity(depth, 'm')} deep, {rule}"]
    return []
