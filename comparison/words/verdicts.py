"""Sentences about verdicts: the reasons of a channel and a scene, and all scenes in one sentence."""

import re
from collections import Counter
from collections.abc import Sequence
from importlib.resources import files
from math import floor, isnan, log10
from typing import NamedTuple

from comparison.accuracy import uncertainty
from comparison.accuracy.levels import thresholds
from comparison.formatting import instant, number, quantity
from comparison.scene import Scene, command_line
from comparison.tables.align import Shift
from comparison.verdict.confirmation import ENOUGH_MEMBERS, MEMBERS, OTHER_MEMBERS
from comparison.verdict.results import (
    METRICS,
    Basis,
    ChannelComparison,
    Check,
    SceneComparison,
    decisive,
    rank,
)
from comparison.verdict.validate import Standing
from comparison.words.differences import attribution_lines, causes, confirmation, plain_percent
from comparison.words.reliability import line as reliability_line

SYMBOLS = {
    "agree": "✓",
    "differ": "✗",
    "indeterminate": "?",
    "undecided": "?",
    "unexcited": "○",
    "cannot compare": "!",
}
"""Verdict -> sign beside it, for readers without colour."""

_REASONS = {
    Basis.RANGE: "its range in both, {extent}, is below {floor}",
    Basis.NO_LIMIT: "there is neither an uncertainty nor a tolerance",
    Basis.ERROR: "it is an error of each run, which no share of its own range limits",
    Basis.COVERAGE: "{c.coverage:.1%} of the samples are predictable, required: at least "
    "{least.coverage:.0%}",
    Basis.NOTHING_JUDGED: "no predictable sample is non-zero",
    Basis.FEW_JUDGED: "{count} predictable samples are non-zero, required: at least {least.least_judged}",
    Basis.FEW_OUTSIDE: "{c.outside} of {count} {judged} are outside their threshold: too many to "
    "agree, {few} that show a difference",
    Basis.LARGEST: "at t = {at} s the difference is {difference}, the threshold, {least.k:g} times the "
    "largest uncertainty of all times, {threshold}",
    Basis.SAMPLES: "{c.outside} of {count} {judged} are outside {what}, {nearest} at t = {at} s: the "
    "difference{late} is {difference}, the threshold {threshold}",
}
_PLURALS = {
    "cannot compare": ("cannot be compared", "cannot be compared"),
    "differ": ("differs", "differ"),
    "indeterminate": ("is indeterminate", "are indeterminate"),
    "agree": ("agrees", "agree"),
}
_PAIRS = {
    "differ": "{} differ",
    "indeterminate": "{}: indeterminate",
    "cannot compare": "{}: cannot compare",
    "agree": "{} agree",
}
_MARKS = {
    "confirmed": "confirmed by at least {0.fewest} runs",
    "unconfirmed": "unconfirmed, {0.fewest} runs",
    "underestimated": "uncertainty underestimated {0.factor:.2g} times",
}
_TIMES = ("", "once", "twice", "three times", "four times", "five times")


def reason(channel: ChannelComparison) -> str:
    """Return the reason of a channel's verdict."""
    if channel.basis is Basis.GATE:
        return _gate(channel)

    def with_unit(value: float, digits: int = 3) -> str:
        return f"{value:.{digits}g} {channel.unit}".rstrip()  # another mechanism's unit may be unknown

    fixed, tolerance, row = channel.u is None, channel.time_tolerance, max(0, (channel.worst or 0) - 1)
    every = channel.nonzero[channel.predictable].all()
    text = _REASONS[channel.basis].format(
        c=channel,
        least=channel.limits,
        count=int(channel.judged.sum()),
        extent=with_unit(channel.extent, 2),
        floor=with_unit(channel.definition.floor),
        at=instant(channel.worst_time, *channel.time[row : (channel.worst or 0) + 2]),
        difference=with_unit(channel.worst_size if tolerance else channel.worst_difference),
        threshold=with_unit(channel.worst_threshold, 2),
        judged="samples" if fixed else f"predictable{'' if every else ' non-zero'} samples",
        what="the tolerance" if fixed else "their threshold",
        nearest="at worst" if channel.outside else "the nearest",
        late=f" within {tolerance:g} s" if tolerance else "",
        few="too few before the last window"
        if channel.outside >= channel.limits.least_outside
        else f"fewer than the {channel.limits.least_outside}",
    )
    if channel.basis is not Basis.SAMPLES:
        return text
    if fixed and channel.worst_threshold == 0.0:
        text += "; the channel is constant in the first table, so its scale is zero unless one is given"
    if channel.verdict == "differ" and channel.limits.share < 1.0:
        text += f"; {channel.explained:.1%} are within, required: at least {100 * channel.limits.share:g}%"
    if channel.verdict == "differ" and channel.coverage < channel.limits.coverage:
        text += f"; that is decided although only {channel.coverage:.1%} of the samples are predictable"
    return text


def _gate(channel: ChannelComparison) -> str:
    """Return the limit of a gate that a metric misses, or a sentence that all are met."""
    failures = [check for check in channel.checks if not check.met]
    if not failures:
        count = len(channel.checks)
        return f"all {count} limits of the gate are met" if count > 1 else "the limit of the gate is met"
    check = max(failures, key=lambda check: not isnan(check.value))  # a known value before an undefined one
    if isnan(check.value):
        return f"{check.metric} is undefined: one of the two is constant"
    return f"{check.metric} is {number(check.value)}, required: {bound(check)}"


def bound(check: Check) -> str:
    """Return "at most 0.001"."""
    return f"{'at most' if METRICS[check.metric] > 0 else 'at least'} {check.limit:g}"


def round_down(time: float) -> str:
    """Return a time rounded down to two digits."""
    if not time > 0.0:
        return number(time, 2)
    digit = 10.0 ** (floor(log10(time)) - 1)
    return number(digit * floor(time / digit + 1e-6), 2)


def until(channel: ChannelComparison) -> str:
    """Return the time until which a channel is predictable, and the number of shorter gaps: "0.45 (+2)"."""
    ends = channel.until == channel.time[-1]
    text = instant(channel.until) if ends or isnan(channel.until) else round_down(channel.until)
    return f"{text} (+{channel.isolated})" if channel.isolated else text


def agreement(scene: SceneComparison) -> str:
    """Return the time until which two results agree, or from which they differ; "" if coverage decides.

    It is, for example, "until 24 s of 40: --until states how long is enough".
    """
    demand = scene.demand
    if scene.scene is not None and demand is None:
        return ""
    if scene.verdict == "differ":
        return "" if isnan(scene.since) else f"from {scene.since:.4g} s on"
    if scene.verdict != "agree" or isnan(scene.until):
        return ""
    end = float(scene.time[-1])
    text = f"until {round_down(scene.until)} s of {instant(end)}" if scene.until < end else ""
    if scene.enough:
        return text
    lacks = "--until states how long is enough" if demand is None else f"{demand:g} s are demanded"
    return f"{text or f'until {instant(end)} s'}: {lacks}"


def predictable(scene: SceneComparison) -> str:
    """Return the time until which two results are judged, the window and the resolution; empty without u."""
    if (first := scene.first_unpredictable) is None:
        return ""
    ends = first.until == scene.time[-1]
    text = "to the end" if ends else f"until {round_down(first.until)} s ({first.channel})"
    largest = max(c.resolution for c in scene.excited.values() if not isnan(c.resolution))
    return (
        f"{text}, by a window of {quantity(scene.window, 's', 2)}; resolution: half of the thresholds are "
        f"below {number(largest, 2)} of the scale in each channel"
    )


def threshold_name(channel: ChannelComparison) -> str:
    """Return the name of the threshold of |difference|: "2 u", or "tolerance"; empty without one."""
    if channel.u is not None:
        return f"{channel.limits.k:g} u"
    return "" if channel.tolerance is None else "tolerance"


def scene_reason(scene: SceneComparison, *, brief: bool = False) -> str:
    """Return the reason of a scene's verdict; if brief, without times and reasons of single channels."""
    if scene.error:
        return scene.error if scene.scene is None else f"scene {scene.name!r}: {scene.error}"
    if not isnan(scene.allowed_shift):
        return f"{shift_line(scene)} The tolerance allows {scene.allowed_shift:.2g} s"
    differing, unsettled, agreeing = map(scene.with_verdict, ("differ", "indeterminate", "agree"))
    count = len(scene.excited)
    differ = f"{len(differing)} of {count} channels differ, most of all {_worst(differing)}"
    if scene.unsettled:
        return (
            "the models differ, but the five bodies have not converged: at a step of "
            f"{_step(scene):g} s refinement still moves them by as much, or a finer run failed. {differ}"
        )
    if not count:
        return "no channel is excited: nothing was compared"
    if scene.verdict == "differ":
        return differ
    if scene.verdict == "indeterminate":
        if not unsettled:
            return "too few samples are predictable"
        worst = min(unsettled, key=lambda channel: channel.coverage)
        example = "" if len(set(map(reason, unsettled))) == 1 else f", most of all {worst.channel}"
        return f"{len(unsettled)} of {count} channels are indeterminate{example}: {reason(worst)}"
    time_text = "" if brief and not scene.enough else agreement(scene)  # the mark beside it
    text = " ".join(filter(None, (f"{len(agreeing)} of {count} excited channels agree", time_text)))
    if decisive(agreeing) is not None:
        text += f", nearest to its limit {_worst(agreeing)}"
    elif agreeing:  # by the limits of a gate
        text += f": {reason(agreeing[0])}"
    text += f"; {plain_percent(scene.coverage)} of all samples are predictable" if scene.has_u else ""
    if unsettled:
        names = [c.channel if brief else f"{c.channel} ({reason(c)})" for c in unsettled]
        text += f"; indeterminate: {', '.join(names)}"
    return text


def _worst(channels: Sequence[ChannelComparison]) -> str:
    """Return the worst of the judged channels with its reason; the first one if none has a ratio."""
    worst = decisive(channels)
    if worst is None:
        return f"{channels[0].channel}: {reason(channels[0])}" if channels else "none by itself"
    return f"{worst.channel}, {worst.ratio_name} = {number(worst.ratio, 2)}: {reason(worst)}"


def finer_runs(scene: SceneComparison) -> str:
    """Return the settings of refined runs; empty where the models ran at the stated ones."""
    if not scene.refined:
        return ""
    if not scene.halved:
        return f"judged at settings refined {_TIMES[scene.refined]}: at the stated ones the two differ"
    return (
        "judged with finer runs, since those at the scene's settings left the verdict open: step of "
        f"five bodies halved {_TIMES[scene.refined]}, to {_step(scene):.3g} s"
    )


def _step(scene: SceneComparison) -> float:
    assert scene.scene is not None
    return float(scene.scene["solver"]["exudyn"]["step"])


def why(scene: SceneComparison) -> str:
    """Return causes, confirmation, refinement and reason of a verdict in one text."""
    parts = *causes(scene), confirmation(scene), finer_runs(scene), scene_reason(scene)
    return ". ".join(filter(None, parts))


def mark(scene: SceneComparison) -> str:
    """Return the note beside a verdict: time without agreement, refined runs, confirmation."""
    marks = [] if scene.enough else [agreement(scene)]
    how = "step halved" if scene.halved else "refined"
    marks += [f"{how} {_TIMES[scene.refined]}"] if scene.refined else []
    if (result := scene.confirmation) is not None:
        marks.append(_MARKS[result.outcome].format(result))
    return "; ".join(marks)


def shift(estimate: Shift, labels: tuple[str, str]) -> str:
    """Return the estimated time shift between two results as a sentence."""
    if estimate.reason:
        return f"A time shift between the two cannot be estimated: {estimate.reason}."
    size = f"{abs(estimate.value):.3g} s ± {estimate.uncertainty:.2g} s"
    if not estimate.significant:
        return f"No time shift above three times its uncertainty: {size}."
    later, earlier = labels[::-1] if estimate.value > 0 else labels
    return f"{later} is later than {earlier} by {size} (estimated, not applied)."


def shift_line(scene: SceneComparison) -> str:
    """Return the estimated time shift between the two results, if any."""
    return "" if scene.shift is None else shift(scene.shift, scene.labels)


def reasons(scene: SceneComparison) -> list[tuple[str, str]]:
    """Return the reasons of a verdict at one tier as pairs of topic and sentence."""
    constant = [name for name in scene.channels if name not in scene.excited]
    lines = [
        ("reason", scene_reason(scene)),
        ("runs", finer_runs(scene)),
        ("confirmation", confirmation(scene)),
        ("predictable", predictable(scene)),
        ("unexcited", f"{', '.join(constant)}: constant in both" if constant else ""),
        ("why", "; ".join(attribution_lines(scene))),
        ("reliability", "" if scene.reliability is None else reliability_line(scene.reliability)),
    ]
    return [(topic, text) for topic, text in lines if text]


def overall_verdict(scenes: Sequence[SceneComparison]) -> str:
    """Return the worst verdict of the scenes at any tier; without a scene nothing was compared."""
    verdicts = [tier.verdict for scene in scenes for tier in scene.tiers]
    return max(verdicts, key=rank, default="cannot compare")


def headline(scenes: Sequence[SceneComparison]) -> str:
    """Return one sentence for all scenes: "Of 8 scenes 1 differs and 7 agree.", by tier if there are two."""
    tight = [scene.tight for scene in scenes if scene.tight is not None]
    text = _count_text(scenes)
    text = f"At the standard tier {text}; at the tight tier {_count_text(tight)}" if tight else text
    results = [tier.confirmation for tier in (*scenes, *tight) if tier.confirmation is not None]
    count = sum(result.outcome == "underestimated" for result in results)
    rest = "1 of these verdicts rests" if count == 1 else f"{count} of these verdicts rest"
    return f"{_capital(text)}." + (f" {rest} on a corrected uncertainty." if count else "")


def _count_text(scenes: Sequence[SceneComparison]) -> str:
    if not scenes:
        return "there is no scene to compare"
    if len(scenes) == 1:
        one, several = _PLURALS[scenes[0].verdict]
        # Tables of other programs have no scene.
        text = f"the two {several}" if scenes[0].scene is None else f"the scene {scenes[0].name} {one}"
        return " ".join(filter(None, (text, agreement(scenes[0]))))
    count = Counter(scene.verdict for scene in scenes)
    parts = [
        f"{count[verdict]} {words[count[verdict] > 1]}"
        for verdict, words in _PLURALS.items()
        if count[verdict]
    ]
    what = "scenes" if any(scene.run_scene or scene.failed_job for scene in scenes) else "pairs of tables"
    return f"all {parts[0]}" if len(parts) == 1 else f"of {len(scenes)} {what} {join_names(parts)}"


def incomplete(scenes: Sequence[SceneComparison], missing: Sequence[str]) -> str:
    """Return a sentence on the scenes that were not compared; empty if all were."""
    if not missing:
        return ""
    total, names = len(scenes) + len(missing), ", ".join(missing)
    return f"Incomplete: interrupted after {len(scenes)} of {total} scenes. Not compared: {names}."


def standing(result: Standing) -> str:
    """Return a sentence on the models, of three or more, that agree, and on the outlier."""
    models, outlier = result.compared, result.outlier
    if result.outcome == "cannot compare":
        text = "no two models can be compared"
    elif result.outcome == "agree":
        text = f"{join_names(models)} agree" if len(models) == 2 else f"all {len(models)} agree"
    elif outlier:
        others = join_names([model for model in models if model != outlier])
        text = f"{outlier} is the outlier: it differs from {others}, which agree"
    else:
        head = "undecided" if result.outcome == "undecided" else "no model is the outlier"
        pairs = sorted(result.verdicts.items(), key=lambda item: list(_PAIRS).index(item[1]))
        text = f"{head}: {'; '.join(_PAIRS[verdict].format(join_names(pair)) for pair, verdict in pairs)}"
    if result.left_out:
        text += f"; {join_names(result.left_out)} cannot be compared"
    return f"{_capital(text)}."


def join_names(names: Sequence[str]) -> str:
    """Return "a, b and c"."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _capital(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}"


# ---- the card of a scene, and the definition of the verdicts, for pages


class Card(NamedTuple):
    """Texts of a card: reason of the verdict, observed orders, next step and its commands."""

    sentence: str
    order: str
    advice: str
    commands: tuple[str, ...]


def card(scene: SceneComparison) -> Card:
    """Return the card of a scene at one tier."""
    order = ", ".join(
        f"{change.label} {number(change.observed, 2)} (expected {change.order:g})"
        for change in scene.attribution.refinements
        if not isnan(change.observed)
    )
    sentence = "; ".join(filter(None, (*causes(scene), scene_reason(scene, brief=True), mark(scene))))
    return Card(f"{sentence}.", order, *_next(scene))


def _next(scene: SceneComparison) -> tuple[str, tuple[str, ...]]:
    """Return the next step after a verdict, and its commands; both empty where there is none."""
    closer, setup = scene.closer_command, scene.run_scene
    if scene.verdict == "indeterminate" and closer:
        tables = "State the difference that is allowed, as a share of each scale:"
        return tables if setup is None else "See whether finer settings decide it:", (closer,)
    if scene.verdict == "indeterminate" and setup is not None and setup.source and not setup.is_linkage:
        half = setup.variant({"drive.cycles": 0.5 * setup.data["drive"]["cycles"]})
        return "See whether half the time is predictable:", (half.command("validate"),)
    if setup is None or scene.verdict == "indeterminate":
        return "", ()
    if scene.verdict == "cannot compare":
        if scene.failed_job is None:
            again = (scene.command,) if scene.command else ()
            return "Run the scene again once the cause is removed:", again
        job = scene.failed_job
        return "Repeat the run that failed, alone:", (_run(job.scene, job.model, scene.name),)
    if scene.verdict == "differ" and not setup.is_linkage:
        return "Find which model errs, by a third opinion:", _third_opinion(scene, setup)
    if scene.confirmation is not None and scene.confirmation.suspicious:
        what = "A discontinuous event decides"
        return (f"{what}; look at it at finer settings:", (closer,)) if closer else (f"{what}.", ())
    return "", ()


def _third_opinion(scene: SceneComparison, setup: Scene) -> tuple[str, ...]:
    """Return commands that run another formulation of one model and compare it with the reference."""
    model, formulation, host = "exudyn", "full", scene.labels[0]
    if setup.data["solver"]["exudyn"]["formulation"] == "full":
        formulation = "tree"
        if "crank_pin" not in setup.loose:  # the reference's multipliers need an ideal pin
            model, formulation, host = "reference", "multiplier", scene.labels[1]
    third = setup.variant({f"solver.{model}.formulation": formulation})
    compare = command_line("compare", [f"{scene.name}-{part}.csv" for part in (host, formulation)], {})
    return _run(third, model, scene.name, formulation), _run(setup, host, scene.name), compare


def _run(scene: Scene, model: str, name: str, what: str = "") -> str:
    return scene.command("run", "--model", model, "--out", f"{name}-{what or model}.csv")


def definition(scenes: Sequence[SceneComparison]) -> list[str]:
    """Return the definition of the verdicts of these scenes, one step per line."""
    import jinja2

    tiers = [tier for scene in scenes for tier in scene.tiers]
    channels = [channel for tier in tiers for channel in tier.channels.values()]
    template = jinja2.Template(
        files("comparison.words").joinpath("definition.j2").read_text("utf-8"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    text = template.render(
        u=uncertainty,
        usual=thresholds(),
        tiers={tier.tier: thresholds(tier.tier) for tier in tiers},
        uncertain=any(channel.u is not None for channel in channels),
        fixed=any(channel.u is None for channel in channels),
        of_scene=any(tier.scene or (tier.run_scene and not tier.run_scene.is_linkage) for tier in tiers)
        or not tiers,
        of_tables=any(tier.scene is None for tier in tiers),
        first=uncertainty.FIRST,
        perturbation=number(uncertainty.PERTURBATION, 1),
        other_members=OTHER_MEMBERS,
        members=MEMBERS["reference"],
        enough=ENOUGH_MEMBERS,
        attributed=any(tier.attribution.remaining for tier in tiers),
        late=[quantity(time, "s") for time in dict.fromkeys(c.time_tolerance for c in channels) if time],
        limits=", ".join(
            dict.fromkeys(f"{check.metric} {bound(check)}" for c in channels for check in c.checks)
        ),
    )
    return [" ".join(part.split("\n")) for part in re.split("\n\n+", text.strip()) if part]


def ratio_name(scenes: Sequence[SceneComparison]) -> str:
    """Return the name of the ratio that decides these verdicts."""
    channels = (c.ratio_name for scene in scenes for tier in scene.tiers for c in tier.channels.values())
    limits = thresholds()
    return next(channels, f"|E|/{limits.k:g}u ({100 * limits.share:g}%)")
