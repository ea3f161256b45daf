"""Results for programs: comparisons as mappings for JSON, without curves; comparisons and gates as cases."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, Literal, NamedTuple

from comparison.execution.run import describe
from comparison.regression.check import COUNTERS_ELSEWHERE, Check, Gate, Kind
from comparison.reliability.assessment import Assessment, Difference
from comparison.reliability.tables import TableReliability
from comparison.verdict.results import SceneComparison
from comparison.words import differences
from comparison.words import verdicts as words
from comparison.words.differences import causes
from comparison.words.reliability import missing_reason

_OF_CHANNEL = (
    "coverage", "coverage_error", "explained", "max_difference", "rms_difference", "rms_error", "max_scaled",
    "rms_scaled", "ratio", "largest_ratio", "worst_time", "worst_difference", "worst_size", "worst_threshold",
    "time_tolerance", "outside", "until", "isolated", "differs_from", "resolution",
)  # fmt: skip
_OF_MODEL = ("reliability", "low", "high", "capped", "mean", "deviation", "within")
Status = Literal["passed", "failed", "skipped", "error"]
_STATUS: dict[str, Status] = {
    "agree": "passed",
    "differ": "failed",
    "indeterminate": "skipped",
    "unexcited": "skipped",
    "cannot compare": "error",
}


class Case(NamedTuple):
    """Result of one check; "skipped" if no conclusion is possible, "error" if there was nothing to check."""

    suite: str  # the scene
    group: str  # a tier, or a model and its tier
    name: str  # the channel, or another checked item
    status: Status
    message: str = ""


def of_comparisons(comparisons: Sequence[SceneComparison]) -> list[Case]:
    """Return the verdict of each scene and tier, followed by those of its channels."""
    cases = []
    for tier in (tier for comparison in comparisons for tier in comparison.tiers):
        status = _STATUS[tier.verdict]
        if not tier.enough:
            status = "skipped" if tier.demand is None else "failed"
        cases.append(Case(tier.name, tier.tier, "verdict", status, f"{tier.verdict}: {words.why(tier)}"))
        for name, channel in tier.channels.items():
            text = f"{channel.verdict}: {words.reason(channel)}"
            if channel.until < channel.time[-1]:
                text += f"; predictable until {words.until(channel)} s"
            cases.append(Case(tier.name, tier.tier, name, _STATUS[channel.verdict], text))
    return cases


def as_mapping(comparison: SceneComparison) -> dict[str, Any]:
    """Return all results without curves, for JSON; undefined numbers are nan (written as null)."""
    labels, decisive, impacts = comparison.labels, comparison.decisive, comparison.impacts
    reliability, attribution = comparison.reliability, None
    if comparison.channels:
        attribution = asdict(comparison.attribution)
        attribution["sentences"] = differences.attribution_lines(comparison)
    return {
        "name": comparison.name,
        "tier": comparison.tier,
        "refined": comparison.refined,
        "title": comparison.title,
        "verdict": comparison.verdict,
        "causes": [
            asdict(one) | {"sentence": text}
            for one, text in zip(comparison.causes, causes(comparison), strict=True)
        ],
        "exit_code": comparison.exit_code,
        "coverage": comparison.coverage,
        "until": comparison.until,
        "demanded_until": comparison.demand,
        "window": comparison.window,
        "reason": words.scene_reason(comparison),
        "decisive_channel": decisive and decisive.channel,
        "ratio": decisive and decisive.ratio,
        "warnings": comparison.warnings,
        "labels": labels,
        "samples": comparison.time.size,
        "time_shift": comparison.shift and vars(comparison.shift),
        "command": comparison.command,
        "situations": dict(zip(labels, comparison.situations, strict=True)),
        "confirmation": confirmation_record(comparison),
        "attribution": attribution,
        "impacts": impacts
        and {
            part: {"matched": len(match.pairs)}
            | {key: value for key, value in vars(match).items() if key != "pairs"}
            for part, match in impacts.items()
        },
        "reliability": reliability
        and {
            "verdict": reliability.verdict,
            "missing": missing_reason(reliability),
            "bins": reliability.settings.bins,
            "channels": reliability.settings.channels,
            "errors": reliability.settings.errors,
            "quantities": {
                name: _quantity(dict(zip(labels, (difference.a, difference.b), strict=True)), difference)
                for name, difference in reliability.quantities.items()
            },
        },
        "channels": {
            name: {
                "verdict": channel.verdict,
                "reason": words.reason(channel),
                "unit": channel.unit,
                "scale": channel.scale,
                **{key: getattr(channel, key) for key in _OF_CHANNEL},
                "information": dict(channel.metrics),
                "gate": [asdict(check) | {"met": check.met} for check in channel.checks],
            }
            for name, channel in comparison.channels.items()
        },
        "provenance": comparison.provenance,
        "tight": comparison.tight and as_mapping(comparison.tight),
    }


def confirmation_record(comparison: SceneComparison) -> dict[str, Any] | None:
    """Return the confirmation of a verdict "differ" with its sentence; None where there was none."""
    result = comparison.confirmation
    if result is None:
        return None
    omitted = ("doubt", "parting")
    return {
        **{key: value for key, value in asdict(result).items() if key not in omitted},
        "suspicious": result.suspicious,
        "contact": differences.parting(comparison),
        "sentence": differences.confirmation(comparison),
    }


def reliability_mapping(result: TableReliability) -> dict[str, Any]:
    """Return the reliability of tables, for JSON; undefined numbers are nan (written as null)."""
    differences = result.comparison.quantities if result.comparison else {}
    return {
        "tables": dict(zip("ab", result.names, strict=False)),
        "verdict": result.comparison and result.comparison.verdict,
        "period": result.period,
        "bins": result.settings.bins,
        "errors": result.settings.errors,
        "limits_of": result.source,
        "limits_given": result.given,
        "missing": result.missing,
        "warnings": result.warnings,
        "quantities": {
            name: _quantity(tables, differences.get(name)) for name, tables in result.by_quantity.items()
        },
    }


def _quantity(models: Mapping[str, Assessment], difference: Difference | None) -> dict[str, Any]:
    first = next(iter(models.values()))
    record = {
        "unit": first.unit,
        "lower_limit": first.limits.lower,
        "upper_limit": first.limits.upper,
        "cap": first.cap,
        "angle_deg": first.angle.tolist(),
        "cycles": first.cycles.tolist(),
        "models": {
            label: {
                "smallest": model.minimum,
                "smallest_interval": list(model.interval),
                "smallest_at_deg": float(model.angle[model.worst]),
                **{"at_cap" if key == "capped" else key: getattr(model, key).tolist() for key in _OF_MODEL},
            }
            for label, model in models.items()
        },
    }
    return (
        record
        if difference is None
        else record
        | {
            "verdict": difference.verdict,
            "difference": difference.minimum,
            "half_width_sampling": difference.sampling,
            "half_width_numerical": difference.numerical,
            "half_width": difference.half_width,
            "differences": difference.curve.tolist(),
            "half_widths": difference.curve_half_width.tolist(),
        }
    )


# ---- the gate: checks, notes and summary

_MESSAGES = {
    Kind.SCENE_GONE: "{source!r} of the baseline is neither a shipped scene nor a file",
    Kind.NEW_SCENE: "there is no baseline of it; sixbar gate SCENE --update makes one",
    Kind.NEW_RUN: "there is no baseline of this run; sixbar gate --update makes one",
    Kind.NEW_CHANNEL: "the channel {name} has no baseline; sixbar gate --update makes one",
    Kind.RUN_GONE: "the baseline has this run, the scene does not any more",
    Kind.CHANNEL_GONE: "the channel {name} is in the baseline and not in the run",
    Kind.UNPREDICTABLE: "{name} has no predictable sample at which something happens",
    Kind.NO_SAMPLE: "{name} has no sample at t = {time:g} s, where the baseline has a checkpoint",
    Kind.EXCITED: "{name} was constant in the baseline, within {floor:g} {unit}; now its range is "
    "{extent:.3g} {unit}",
    Kind.MOVED: "{name} at t = {time:g} s is {value:.12g} {unit}, in the baseline {before:.12g} {unit}: off "
    "by {off:.2g} {unit}, {size} of its scale, the threshold is {threshold:.2g} {unit} ({count} of {points} "
    "checkpoints are off)",
}
_THRESHOLDS = (
    "comparison/accuracy/thresholds.toml is not what the baseline was made with: its numbers change only "
    "together with newly measured rates of false alarms and of detected faults"
)


def of_gate(gate: Gate) -> list[Case]:
    """Return all checks with their messages, for the terminal, JUnit and the summary of a job."""
    return [
        Case(check.scene, _group(check), check.name, check.status, check_message(check))
        for check in gate.checks
    ]


def gate_counts(gate: Gate) -> list[tuple[str, str, str, str, str]]:
    """Return a row a scene and run: how many of its checks passed, failed, were skipped."""
    counts: dict[tuple[str, str], Counter[str]] = {}
    for check in gate.checks:
        counts.setdefault((check.scene, _group(check)), Counter())[check.status] += 1
    return [
        (*group, str(n["passed"]), str(n["failed"] + n["error"]), str(n["skipped"]))
        for group, n in counts.items()
    ]


def _group(check: Check) -> str:
    if check.run is not None:
        return " ".join(check.run)
    return "comparison" if check.name == "thresholds" else check.name


def check_message(check: Check) -> str:
    """Return place and size of the deviation of a check, in one line; empty where there is none."""
    kind, data, name = check.kind, check.data, check.name
    if kind is None:
        return ""
    if kind is Kind.THRESHOLDS:
        return _THRESHOLDS
    if kind is Kind.FAILED:
        text = describe(data["job"], data["outcome"])
    elif kind is Kind.CHANGED:
        text = "; ".join(
            f"the {name.removesuffix('s')} {key} is {_or_missing(now)}, in the baseline {_or_missing(before)}"
            for key, (now, before) in data["values"].items()
        )
    else:
        size = {"size": _share(data["share"])} if "share" in data else {}
        text = _MESSAGES[kind].format(name=name, **size, **data)
    where = "" if check.run is None else f"{_group(check)}, "
    return f"{where}scene {check.scene!r}: {text}"


def _share(share: float) -> str:
    return f"{float(f'{100 * share:.2g}'):g}%"  # 480%, not 4.8e+02%


def gate_lines(gate: Gate) -> list[str]:
    """Return the first deviation with its time, place and size, then each run, other checks, counters."""
    moves = deviations(gate)
    runs: dict[tuple[str, str], list[Check]] = {}
    for check in moves:
        runs.setdefault((check.scene, _group(check)), []).append(check)
    lines = [f"from t = {check.data['time']:g} s on: {check_message(check)}" for check in moves[:1]]
    for (scene, run), checks in runs.items():
        worst = max(checks, key=lambda check: float(check.data["largest"]))
        count = "1 channel deviates" if len(checks) == 1 else f"{len(checks)} channels deviate"
        most = f"{worst.name} by {_share(worst.data['largest'])} of its scale at t = {worst.data['peak']:g} s"
        lines.append(f"{run}, scene {scene!r}: {count}, most of all {most}")
    rest = [check for check in gate.regressions if check.kind is not Kind.MOVED]
    others = sorted(rest, key=lambda check: check.name in ("settings", "counters"))
    return lines + [check_message(check) for check in others]


def deviations(gate: Gate) -> list[Check]:
    """Return the channels that deviate, by the time of their first deviation, the largest share first."""
    checks = (check for check in gate.regressions if check.kind is Kind.MOVED)
    return sorted(checks, key=lambda check: (check.data["time"], -check.data["share"]))


def _or_missing(value: object) -> object:
    return "missing" if value is None else value


def gate_notes(gate: Gate) -> list[str]:
    """Return remarks on a gate that are no regressions."""
    remarks = []
    if gate.platform is not None:
        there, here = gate.platform
        remarks.append(f"the baseline was made on {there}; this is {here}")
    if gate.versions:
        versions = "; ".join(
            f"{name} {there or 'none'}, here {here or 'none'}"
            for name, (there, here) in gate.versions.items()
        )
        remarks.append(f"the baseline was made with {versions}")
    if remarks:
        remarks.append(f"counters are therefore compared within {COUNTERS_ELSEWHERE:.0%} and not exactly")
    for item in gate.excuses:
        one = item.channels == 1
        deviate = "1 channel deviates" if one else f"{item.channels} channels deviate"
        remarks.append(
            f"{' '.join(item.run)}, scene {item.scene!r}: {deviate} no more than {item.neighbours} "
            f"runs from neighbouring starts do here; {'its' if one else 'their'} thresholds are too small"
        )
    if gate.valueless:
        remarks.append(f"values of constant channels that it lacks: {gate.valueless}; --update records them")
    if gate.rewritten:
        one, names = len(gate.rewritten) == 1, ", ".join(map(repr, gate.rewritten))
        numbers = "scene {}: its numbers" if one else "scenes {}: their numbers"
        remarks.append(numbers.format(names) + " are not those that the baseline was made with")
    return remarks


def gate_summary(gate: Gate) -> str:
    """Return the result of the checks in one sentence."""
    count = sum(check.status != "skipped" for check in gate.checks)
    if gate.regressions:
        return f"{len(gate.regressions)} of {count} checks failed: the baseline does not hold"
    return f"All {count} checks passed: both models match their baseline"
