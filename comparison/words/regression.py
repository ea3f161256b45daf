"""Sentences about the regression gate: its checks, its notes and what it comes to."""

from comparison.execution.run import describe
from comparison.regression.check import COUNTERS_ELSEWHERE, Check, Gate, Kind
from comparison.tables.channels import channels
from comparison.words.record import Case

_MESSAGES = {
    Kind.SCENE_GONE: "{source!r} of the baseline is neither a shipped scene nor a file",
    Kind.NEW_SCENE: "there is no baseline of it; sixbar gate SCENE --update makes one",
    Kind.NEW_RUN: "there is no baseline of this run; sixbar gate --update makes one",
    Kind.NEW_CHANNEL: "the channel {name} has no baseline; sixbar gate --update makes one",
    Kind.RUN_GONE: "the baseline has this run, the scene does not any more",
    Kind.CHANNEL_GONE: "the channel {name} is in the baseline and not in the run",
    Kind.UNPREDICTABLE: "{name} has no predictable sample at which something happens",
    Kind.NO_SAMPLE: "{name} has no sample at t = {time:g} s, where the baseline has a checkpoint",
    Kind.EXCITED: "in {name} nothing happened in the baseline, its range was below {floor:g} {unit}; now it "
    "is {extent:.3g} {unit}",
    Kind.MOVED: "{name} at t = {time:g} s is {value:.15g} {unit}, in the baseline {before:.15g} {unit}: off "
    "by {off:.2g} {unit}, the threshold is {threshold:.2g} {unit} ({count} of {points} checkpoints are off)",
}
_THRESHOLDS = (
    "comparison/accuracy/thresholds.toml is not what the baseline was made with: its numbers change only "
    "together with newly measured rates of false alarms and of detected faults"
)


def cases(gate: Gate) -> list[Case]:
    """Return all checks with their messages, for the terminal, JUnit and the summary of a job."""
    return [
        Case(check.scene, _group(check), check.name, check.status, message(check)) for check in gate.checks
    ]


def _group(check: Check) -> str:
    if check.run is not None:
        return " ".join(check.run)
    return "comparison" if check.name == "thresholds" else check.name


def message(check: Check) -> str:
    """Return where a check found which deviation, in one line; empty where there is none."""
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
        channel = channels().get(name)
        about = {"floor": channel.floor, "unit": channel.unit} if channel else {}
        text = _MESSAGES[kind].format(name=name, **about, **data)
    where = "" if check.run is None else f"{_group(check)}, "
    return f"{where}scene {check.scene!r}: {text}"


def _or_missing(value: object) -> object:
    return "missing" if value is None else value


def notes(gate: Gate) -> list[str]:
    """Return the remarks about what is not a regression."""
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
    for excused in gate.excused:
        one = excused.channels == 1
        deviate = "1 channel deviates" if one else f"{excused.channels} channels deviate"
        remarks.append(
            f"{' '.join(excused.run)}, scene {excused.scene!r}: {deviate} no more than {excused.neighbours} "
            f"runs from neighbouring starts do here; {'its' if one else 'their'} thresholds are too small"
        )
    changed = "its numbers are not those that the baseline was made with"
    return remarks + [f"scene {name!r}: {changed}" for name in gate.rewritten]


def summary(gate: Gate) -> str:
    """Return in one sentence what the checks come to."""
    checked = sum(check.status != "skipped" for check in gate.checks)
    if gate.regressions:
        return f"{len(gate.regressions)} of {checked} checks failed: a model deviates from its baseline"
    return f"All {checked} checks passed: both models match their baseline"
