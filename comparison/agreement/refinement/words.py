"""What a run with an estimated error costs, and what it has reached, in one line each."""

from __future__ import annotations

from math import inf, isfinite

from comparison.accuracy.levels import expected
from comparison.accuracy.uncertainty import SAFETY_FACTOR, movable, perturbation
from comparison.agreement.planned_runs import levels
from comparison.agreement.refinement.accurate_run import AccurateRun, Limit
from comparison.agreement.refinement.estimate import FLOOR, Estimate
from comparison.agreement.refinement.steps import settings
from comparison.execution.run import Outcome
from comparison.scene import Scene


def cost_before(scene: Scene, model: str, accuracy: str | float | None) -> str:
    """Return what the first setting and the runs that estimate its error are expected to cost."""
    first = next(iter(settings(scene, model, accuracy)))
    family = levels(first, model).values()
    seconds = sum(expected(each, model).seconds for each in family)
    time = f"some {seconds:.2g} s of processor time" if isfinite(seconds) else "no time recorded"
    more = "" if accuracy is None or not _is_number(accuracy) else ", more if it has to be refined"
    return f"begins at {setting(first, model)}, with {len(family) - 1} further runs: {time}{more}"


def setting(scene: Scene, model: str) -> str:
    """Return what a model's error depends on, as a user writes it."""
    solver = scene.data["solver"].get(model, {})
    key = "tolerance" if model == "reference" or solver.get("formulation") == "tree" else "step"
    key = key if key in solver else "tolerance"
    return f"solver.{model}.{key} = {solver[key]:g}" if key in solver else f"the settings of {model}"


def result(found: AccurateRun) -> str:
    """Return what was reached, until when, and why not more."""
    cost = f"{found.runs} runs, {found.seconds:.2g} s"
    at = setting(found.level.scene, found.model)
    of = found.estimate
    if of is None:
        unrefined = "finer" not in found.level.outcomes
        why = "the model has neither a step nor a tolerance" if unrefined else _stopped(found.stopped)
        return f"the error is unknown: {why} ({at}; {cost})"
    if found.wanted is None:
        held = ", ".join(f"{of.held(share):.2g} m on {share:.0%}" for share in (0.5, 0.9, 1.0))
        return f"estimated error of slider_x: at most {held} of the run{_apart(found, of)} ({at}; {cost})"
    if found.kept:
        line = f"slider_x is within {found.wanted:g} m{_where(found, of)}"
        if found.coverage < 1.0:
            line += f"; on the rest within {of.held(1.0):.2g} m{_apart(found, of)}"
        return f"{line} ({at}; {cost})"
    line = f"{found.wanted:g} m is not reachable: it holds{_where(found, of)}"
    reached = f"reached is {of.held(FLOOR):.2g} m on {FLOOR:.0%} of the run"
    return f"{line}; {reached}. {_reason(found, of)} ({at}; {cost})"


def _is_number(accuracy: str | float) -> bool:
    try:
        return isfinite(float(accuracy))
    except ValueError:
        return False


def _where(found: AccurateRun, of: Estimate) -> str:
    """Return on which part of the run the wanted error holds."""
    assert found.wanted is not None
    until = of.until(found.wanted)
    if until == inf:
        return " on all of the run"
    if found.coverage == 0.0:
        return " nowhere"
    cycles = until / found.level.scene.period
    return f" on {found.coverage:.1%} of the run, up to {until:.4g} s ({cycles:.2f} cycles) without a break"


def _apart(found: AccurateRun, of: Estimate) -> str:
    """Return how far neighbouring starts part."""
    scene, farthest = found.level.scene, float(of.spread.max()) / SAFETY_FACTOR
    if movable(scene) is None or farthest == 0.0:
        return ""
    return f", as starts {perturbation(scene):.0e} m apart part by up to {farthest:.2g} m"


def _reason(found: AccurateRun, of: Estimate) -> str:
    """Return why no setting does better."""
    if found.limit is Limit.STARTS:
        return f"No setting does better{_apart(found, of)}"
    if found.limit is Limit.STOPPED:
        return f"Finer settings have no result: {_stopped(found.stopped)}"
    return f"No finer setting is measured{_apart(found, of)}"


def _stopped(outcome: Outcome | None) -> str:
    if outcome is None:
        return "no perturbed run succeeded"
    return f"{outcome.status}{f', {outcome.message}' if outcome.message else ''}"
