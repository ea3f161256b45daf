"""Runs as data: what is to run, and what came of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import log10

from comparison.execution.task_order import Kernels
from comparison.scene import Scene, SceneError
from comparison.tables.table import Table

MODELS = ("reference", "exudyn")
"""Default pair of models, see `comparison.engines.registry`."""

VIOLATED = "invariant-violated"
"""Status of a run that violates an invariant of its model; its table is complete but invalid."""

Progress = Callable[[float], None]


@dataclass(frozen=True)
class Job:
    """Run of a scene by a model."""

    scene: Scene
    model: str

    @property
    def cost(self) -> float:
        """Expected time, s, roughly: it orders the runs and weighs their progress."""
        cycles, solver = float(self.scene.data["drive"]["cycles"]), self.scene.data["solver"]
        if self.model == "exudyn" and solver["exudyn"].get("formulation") == "tree":
            return float(cycles * 10 ** (-log10(solver["exudyn"]["tolerance"]) / 6 - 2.3))
        if self.model == "exudyn":
            return float(1.4e-5 * self.scene.duration / solver["exudyn"]["step"])
        if self.model == "reference":
            return float(cycles * 10 ** (-log10(solver["reference"]["tolerance"]) / 8 - 3))
        return cycles

    @property
    def kernels(self) -> frozenset[Kernels]:
        """Code that the model compiles at its first run."""
        return frozenset([kernels(self.scene, self.model)])


@dataclass(frozen=True)
class Outcome:
    """Outcome of a run.

    Attributes
    ----------
    status
        ``"success"``; ``"bad input"``: the model refuses the scene; ``"crashed"``: the process died or the
        model raised what it should not; ``"unusable"``: the table fails `comparison.tables.table.check`; or
        the model's own status, such as ``"step-too-small"``.
    message
        One line; for a status of the model its remedy.
    table
        The result if the status is ``"success"``.
    partial
        Unchecked results of a run that ended with a status of the model: truncated where it stopped, complete
        where it violated an invariant (`VIOLATED`).
    traceback
        Of what the model raised, if it crashed that way.
    """

    status: str
    message: str = ""
    table: Table | None = None
    partial: Table | None = None
    traceback: str = ""


def kernels(scene: Scene, model: str, engine: str = "") -> Kernels:
    """Return the identifier of the code that a model, or an engine based on it, compiles for a scene."""
    formulation = str(scene.data["solver"].get(model, {}).get("formulation", "auto"))
    contact = scene.data["contact"]
    if model == "reference":
        # It has separate equations for each set of joints with clearance, and for the contacts of sides.
        sides = "sides" if contact["law"] == "foundation" else "corners"
        return (engine or model, formulation, *scene.data["joints"].values(), sides)
    if model == "exudyn":  # all laws in one; a second more with clearance at the crank pin
        return (engine or model, formulation)
    return (engine or model, formulation, contact["law"], contact["impact_speed"])


class RunError(RuntimeError):
    """A run that did not succeed, with its outcome."""

    def __init__(self, outcome: Outcome, job: Job) -> None:
        self.outcome, self.job = outcome, job
        super().__init__(describe(job, outcome))


def describe(job: Job, outcome: Outcome) -> str:
    """Describe in one line why a run did not succeed."""
    where = f"scene {job.scene.name!r}"
    if outcome.status == "bad input":
        return f"{where}: {outcome.message}"
    message = f"; {outcome.message}" if outcome.message else ""
    return f"{where}: the {job.model} run did not succeed: {outcome.status}{message}"


def successful(outcome: Outcome, job: Job) -> Table:
    """Return the table of a run.

    Raises
    ------
    SceneError
        If the model refused the scene, or could not be imported.
    RunError
        If the run did not succeed.
    """
    if outcome.status == "bad input":
        raise SceneError(describe(job, outcome))
    if outcome.table is None:
        raise RunError(outcome, job)
    return outcome.table
