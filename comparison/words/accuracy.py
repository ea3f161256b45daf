"""Sentences about the plan, the expected cost and the error of a run, and about the settings of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees, inf, isfinite, isnan
from typing import TYPE_CHECKING, Any

from comparison.accuracy.levels import Forecast, Plan, formulation, setting_key
from comparison.execution.run import Outcome
from comparison.models import smallest
from comparison.scene import Scene
from comparison.scene.keys import readable
from comparison.tables import channels

if TYPE_CHECKING:  # they load scipy, which a single run does not need
    from comparison.accuracy.refine import AccurateRun, Cost, Estimate
    from comparison.accuracy.work_precision import Candidate, WorkPrecision


_UNMEASURED = "not measured on this scene: estimate it by --check"


def error_of(expected: Forecast) -> str:
    """Return the measured error of a scene's settings, or the option that estimates it."""
    known = expected.own and isfinite(expected.error)
    span = "cycle" if expected.cycles == 1.0 else f"{expected.cycles:g} cycles"
    return f"{expected.error:.2g} m of slider_x over the first {span}" if known else _UNMEASURED


def expectation(expected: Forecast) -> str:
    """Return the expected error and time of a run."""
    time = f"about {expected.seconds:.2g} s"
    if not expected.own:
        return f"expected: {time}; the error is {_UNMEASURED}"
    return f"expected: {error_of(expected)}, and {time}"


def unmeasured_note(expected: Forecast) -> str:
    """Return a sentence if the error of a built-in model's settings is not measured on a scene, else ""."""
    return "" if expected.own or not expected.scene else f"the error of slider_x was {_UNMEASURED}"


def channels_line(scene: Scene) -> str:
    """Return a one-line summary of the time span and the channels of a scene."""
    groups = ", ".join(["motion", *scene.data["output"]["groups"]])
    span = f"{scene.duration:g} s"
    if (speed := scene.data["drive"].get("speed_rpm")) is not None:
        span = f"{scene.duration / scene.period:g} cycles at {speed:g} rpm"
    return f"{scene.name}: {span}, {len(channels.expected(scene.data))} channels ({groups})"


def changes_line(base: str, changes: Sequence[tuple[str, Any, Any]]) -> str:
    """Return the keys that differ from the base scene, with both values; empty without any."""
    keys = ", ".join(f"{key} = {readable(here)} ({readable(there)})" for key, there, here in changes)
    return f"  changed     from {base}: {keys}" if keys else ""


def plan_lines(plan: Plan) -> list[str]:
    """Return a plan as lines for a terminal."""
    integrated = ", ".join(plan.integrated) or "nothing: no degree of freedom besides the drive"
    size = f" ({plan.coordinates} coordinates, {plan.constraints} constraints)" if plan.integrated else ""
    follows = f"{', '.join(plan.prescribed)}: determined by these and by the crank angle"
    expected = plan.expected
    items = [("integrates", integrated + size)]
    for body, (x, y, angle) in plan.start.items():
        place = f"({round(x, 9) + 0.0:g}, {round(y, 9) + 0.0:g}) m, {round(degrees(angle), 6) + 0.0:g} deg"
        items.append(("start", f"{body}: {place}"))
    items += [("follows", follows)] if plan.prescribed else []
    items += [("contacts", ", ".join(plan.contacts) or "none")]
    items += [("load", plan.load)] if plan.load else []
    items += [("left out", f"{item}: {reason}") for item, reason in plan.left_out]
    items += [("note", plan.note)] if plan.note else []
    items += [("error", error_of(expected))] if expected else []
    if expected and isfinite(expected.seconds):
        where = "" if expected.own else f", as on {expected.scene}"
        items.append(("time", f"about {expected.seconds:.2g} s{where}"))
    for setting, name, ratio in plan.instead:
        cost = f", {ratio:.2g} times the time" if isfinite(ratio) else ""
        items.append(("instead", f"{setting}: {name}{cost}"))
    return [f"{plan.model}: {plan.formulation}", *(f"  {name:<10}  {text}" for name, text in items)]


def cost_before(cost: Cost) -> str:
    """Return the first setting, and the expected time of the runs that estimate its error."""
    time = f"some {cost.seconds:.2g} s of processor time" if isfinite(cost.seconds) else "no time recorded"
    more = ", more if it has to be refined" if cost.refines else ""
    return f"begins at {_setting(cost.scene, cost.model)}, with {cost.further} further runs: {time}{more}"


def accuracy_line(run: AccurateRun) -> str:
    """Return the error of a run, the time up to which it holds, and the reason why it is not smaller."""
    from comparison.accuracy.refine import FLOOR, Limit

    cost = f" ({_setting(run.level.scene, run.model)}; {run.runs} runs, {run.seconds:.2g} s of wall time)"
    estimate, scene = run.estimate, run.level.scene
    if estimate is None:
        unrefined = "finer" not in run.level.outcomes
        why = "the model has neither a step nor a tolerance" if unrefined else _stop_reason(run.failure)
        return f"the error is unknown: {why}{cost}"
    if run.wanted is None:
        parts = ", ".join(f"{estimate.error_on(share):.2g} m on {share:.0%}" for share in (0.5, 0.9, 1.0))
        where = f"at most {parts} of the run{_divergence(scene, estimate)}"
        return f"estimated error of slider_x, a bound: {where}{cost}"
    until, where = estimate.until(run.wanted), "nowhere"
    if until == inf:
        where = "on all of the run"
    elif run.coverage > 0.0:
        gap = f"{until:.4g} s ({until / scene.period:.2f} cycles)"
        where = f"on {run.coverage:.1%} of the run, without a gap up to {gap}"
    if run.kept:
        line = f"slider_x is within {run.wanted:g} m {where}"
        if run.coverage < 1.0:
            line += f"; elsewhere within {estimate.error_on(1.0):.2g} m{_divergence(scene, estimate)}"
        exact = "; x of an ideal slider is exact at any setting: for y use a named accuracy"
        return line + (exact if scene.loose == ("crank_pin",) else "") + cost
    reason = {
        Limit.DIVERGENCE: f"No setting does better{_divergence(scene, estimate)}",
        Limit.FAILURE: f"Finer settings have no result: {_stop_reason(run.failure)}",
        Limit.FINEST: "No finer setting is measured",
    }[run.limit or Limit.FINEST]
    return (
        f"{run.wanted:g} m is not reachable: it holds {where}; {estimate.error_on(FLOOR):.2g} m is reached "
        f"on {FLOOR:.0%} of the run. {reason}{_way_out(run)}{cost}"
    )


def _way_out(run: AccurateRun) -> str:
    """Return a clause on the formulation with smaller errors, if the steps of this one are the limit."""
    from comparison.accuracy.refine import Limit

    scene, model = run.level.scene, run.model
    least = smallest(model, scene.data)
    fixed = setting_key(model, scene.data["solver"].get(model, {})) == "step"
    if run.limit is Limit.DIVERGENCE or not fixed or least == formulation(scene, model):
        return ""
    return f"; the formulation {least} errs less: --formulation {least}"


def _setting(scene: Scene, model: str) -> str:
    """Return the setting that determines a model's error, as a user writes it."""
    solver = scene.data["solver"].get(model, {})
    key = setting_key(model, solver)
    return f"solver.{model}.{key} = {solver[key]:g}" if key in solver else f"the settings of {model}"


def _divergence(scene: Scene, estimate: Estimate) -> str:
    """Return a clause on the divergence of neighbouring trajectories; empty without one."""
    from comparison.accuracy.uncertainty import SAFETY_FACTOR, perturbation

    farthest = float(estimate.spread.max()) / SAFETY_FACTOR
    if not scene.loose or farthest == 0.0:
        return ""
    starts = f"{perturbation(scene):.0e} m"
    return f", since trajectories from starts {starts} apart diverge by up to {farthest:.2g} m"


def _stop_reason(outcome: Outcome | None) -> str:
    if outcome is None:
        return "no perturbed run succeeded"
    return f"{outcome.status}, {outcome.message}" if outcome.message else outcome.status


def settings_basis(result: WorkPrecision) -> str:
    """Return the run from which errors of settings are measured, and the part of it that is confirmed."""
    from comparison.accuracy.uncertainty import SAFETY_FACTOR

    if result.exact is None or result.confirming is None:
        return "no two runs have a result: errors are unknown"
    exact, other = _title(result.exact.candidate), _title(result.confirming.candidate)
    within = f"{other} and neighbouring starts are" if result.neighbours else f"{other} is"
    distance, part = result.resolution / SAFETY_FACTOR, result.coverage(result.resolution)
    where = f"{within} within {distance:.1g} m of it: {part:.1%} of the run"
    line = f"errors of slider_x against {exact}, where {where}"
    return line if result.confirmed else f"{line}; no run of the other model confirms it"


def settings_table(result: WorkPrecision) -> list[tuple[str, str, str, str]]:
    """Return the headings, and a row for each setting, by formulation from coarse to fine."""
    from comparison.accuracy.work_precision import SETTINGS

    order = list(SETTINGS)
    rows = [("setting", "error (m)", "time (s)", "front")]
    for row in sorted(
        result.rows, key=lambda row: (order.index(row.candidate.formulation), -row.candidate.setting)
    ):
        title, error, mark = _title(row.candidate), result.error(row), "*" if row in result.front else ""
        if row.x is None:
            rows.append((title, "", "", row.status))
        else:
            rows.append((title, "" if isnan(error) else f"{error:.1e}", f"{row.seconds:.3g}", mark))
    return rows


def settings_commands(result: WorkPrecision) -> list[tuple[str, str]]:
    """Return each range of errors with the part of the run on which it holds, and the cheapest command."""
    from comparison.accuracy.work_precision import DECADES

    cheapest = {error: row for error in DECADES if (row := result.cheapest(error)) is not None}
    lines = []
    for row in dict.fromkeys(cheapest.values()):
        errors = [error for error, best in cheapest.items() if best is row]
        ends = (errors[0], errors[-1])
        span = " to ".join(dict.fromkeys(f"{error:.0e}" for error in ends))
        part = " to ".join(dict.fromkeys(f"{result.coverage(error):.0%}" for error in ends))
        scene, model = row.candidate.scene, row.candidate.model
        command = scene.command("run", "--model", model, "--out", f"{scene.name}.csv")
        lines.append((f"{span} m on {part} of the run, {row.seconds:.2g} s of processor time", command))
    return lines


def _title(candidate: Candidate) -> str:
    return f"{candidate.model} {candidate.formulation}, {candidate.key} {candidate.setting:g}"
