"""One scene through the stages: the cheap look, both families of runs, confirmation, third opinions.

Each stage is entered only if the one before asks for it. A row says how far the scene came and what was
found.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict

from comparison.accuracy.levels import refinement, thresholds
from comparison.accuracy.refine import levels
from comparison.execution.run import VIOLATED, Outcome
from comparison.execution.store import Row
from comparison.models import MODELS
from comparison.scene import Scene
from comparison.studies.campaign.adjudication import Run, adjudicate
from comparison.studies.campaign.population import Case
from comparison.studies.campaign.screening import TIER, screen
from comparison.studies.campaign.walls import breaches
from comparison.studies.detection.pairs import summary
from comparison.tables.table import Table, TableError
from comparison.verdict.compare import Runs, compare
from comparison.verdict.results import SceneComparison
from comparison.words.record import confirmation_record

Confirm = Callable[[SceneComparison, tuple[Runs, Runs], Scene, Run], SceneComparison]
"""Confirms a verdict "differ" by ensembles: a comparison, the runs, what they ran, who runs it."""

SCREENED, COMPARED = "single runs", "families"
"""How far a scene came."""
AGREE, UNDERESTIMATED, DIFFER = "agree", "underestimated", "differ"
BROKEN, NOT_DECIDED, FAILED = "broken invariant", "not decided", "cannot compare"
OUTCOMES = (AGREE, UNDERESTIMATED, DIFFER, BROKEN, NOT_DECIDED, FAILED)


class _FailedError(Exception):
    """A run without which there is nothing to compare."""


class _Scene:
    """The runs of one scene, each made when first asked for; ``failures`` lists those without success."""

    def __init__(self, scene: Scene, run: Run) -> None:
        self.scene, self.failures = scene, list[Row]()
        self._run = run
        self._levels = {model: levels(scene, model) for model in MODELS}
        self._outcomes: dict[tuple[str, str], Outcome] = {}

    def base(self, model: str) -> Table | None:
        """Run a model at the scene's settings; None if that fails."""
        return self._outcome(model, "base").table

    def family(self, model: str) -> Runs:
        """Run a model at all its levels.

        Raises
        ------
        _FailedError
            If a run fails.
        """
        tables = {kind: self._outcome(model, kind).table for kind in self._levels[model]}
        there = {kind: table for kind, table in tables.items() if table is not None}
        if len(there) < len(tables):
            raise _FailedError
        return Runs(refinement=refinement(model, self.scene), **there)

    def _outcome(self, model: str, kind: str) -> Outcome:
        if (model, kind) not in self._outcomes:
            outcome = self._run(self._levels[model][kind], model)
            self._outcomes[model, kind] = outcome
            if outcome.table is None:
                self.failures.append(
                    {
                        "model": model,
                        "kind": kind,
                        "status": outcome.status,
                        "message": outcome.message,
                        "invariants": broken(outcome.partial),
                    }
                )
        return self._outcomes[model, kind]


def broken(table: Table | None) -> list[str]:
    """Return the names of the invariants that a run says it broke."""
    found = {} if table is None else table.provenance.get("invariants", {})
    return [name for name, of in found.items() if of["value"] > of["bound"]]


def examine(case: Case, run: Run, confirm: Confirm) -> Row:
    """Take a scene through the stages.

    Returns
    -------
    row
        ``outcome``, one of `OUTCOMES`; ``reason``; ``stage``, `SCREENED` or `COMPARED`; ``screening``, as
        `comparison.studies.campaign.screening.Screening`; ``coverage``; ``breaches`` by model, as
        `comparison.studies.campaign.walls.Breach`; ``failures``; ``first``, the earliest sample of a
        difference; ``confirmation`` and ``adjudication``, None where there was nothing to confirm;
        ``seconds`` by stage.
    """
    runs = _Scene(case.scene, run)
    row = nothing_found("") | {"stage": SCREENED, "failures": runs.failures}
    try:
        _into(row, case, runs, run, confirm)
    except _FailedError:
        first = runs.failures[0]
        row["reason"] = f"{first['model']}, {first['kind']} run: {first['status']}"
        if any(one["status"] == VIOLATED for one in runs.failures):
            row["outcome"] = BROKEN
    except TableError as error:
        row["reason"] = str(error)
    if row["outcome"] != DIFFER and any(row["breaches"].values()):
        messages = [f"{model}: {one['name']}" for model, of in row["breaches"].items() for one in of]
        row |= {"outcome": BROKEN, "reason": "; ".join(dict.fromkeys(messages))}
    return row


def nothing_found(reason: str) -> Row:
    """Return the row of a scene of which nothing is known but why."""
    return {"outcome": FAILED, "reason": reason, "stage": "", "screening": None, "coverage": None} | {
        "breaches": {}, "failures": [], "first": None, "confirmation": None, "adjudication": None,
        "seconds": {},
    }  # fmt: skip


def _into(row: Row, case: Case, runs: _Scene, run: Run, confirm: Confirm) -> None:
    """Go from stage to stage and note what is found in the row."""
    clock = _Clock(row["seconds"])
    bases = {model: runs.base(model) for model in MODELS}
    shown = {model: [asdict(one) for one in breaches(table)] for model, table in bases.items() if table}
    row["breaches"] = shown
    reference, tree = runs.family(MODELS[0]), bases[MODELS[1]]
    if tree is None:
        raise _FailedError
    found = screen(case.scene, reference, tree)
    row |= {"screening": asdict(found), "coverage": found.coverage}
    clock.lap("single runs")
    if not (found.parted or case.family or any(shown.values())):
        if found.coverage >= thresholds(TIER).coverage:
            row["outcome"] = AGREE
        else:
            row |= {"outcome": NOT_DECIDED, "reason": f"{found.coverage:.1%} of the samples are predictable"}
        return
    row["stage"] = COMPARED
    both = reference, runs.family(MODELS[1])
    result = compare(*both, scene=case.scene, tier=TIER, labels=MODELS)
    clock.lap("families")
    if result.verdict == "differ":
        result = confirm(result, both, case.scene, run)
        row["confirmation"] = confirmation_record(result)
        clock.lap("confirmation")
    shortened = summary(result)
    coverage = _coverage(result)
    row |= {"outcome": outcome_of(result, coverage), "coverage": coverage}
    row |= {"reason": shortened["reason"], "first": shortened["first"]}
    if result.verdict == "differ":
        row["adjudication"] = adjudicate(result, (reference.base, tree), case.scene, run)
        clock.lap("adjudication")


class _Clock:
    """Laps of processor time, s, into a mapping."""

    def __init__(self, seconds: dict[str, float]) -> None:
        self._seconds, self._last = seconds, time.process_time()

    def lap(self, name: str) -> None:
        """Note the time since the last lap."""
        now = time.process_time()
        self._seconds[name], self._last = now - self._last, now


def outcome_of(result: SceneComparison, coverage: float) -> str:
    """Return the outcome of a comparison whose difference, if it had one, went through confirmation.

    Agreement counts only with `coverage` at the tier's floor or above, as in the first stage.
    """
    if result.verdict == "differ":
        return DIFFER
    if result.verdict == "agree" and result.confirmation is not None:
        return UNDERESTIMATED
    enough = coverage >= thresholds(TIER).coverage
    return AGREE if result.verdict == "agree" and enough else NOT_DECIDED


def _coverage(result: SceneComparison) -> float:
    """Return the least coverage of a position that is excited."""
    positions = [result.channels[name] for name in ("slider_x", "slider_y")]
    return min((one.coverage for one in positions if one.verdict != "unexcited"), default=0.0)
