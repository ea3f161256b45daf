"""Sentences about the regression gate: its checks, its notes and what it comes to."""

from __future__ import annotations

from comparison.execution.run import describe
from comparison.regression.check import (
    COUNTERS_ELSEWHERE,
    Changed,
    Check,
    Excited,
    Gate,
    Lack,
    Moved,
    NoSample,
    RunFailed,
    SceneGone,
)
from comparison.tables.channels import channels
from comparison.words.cases import Case


def cases(gate: Gate) -> list[Case]:
    """Return all checks with their messages, for the terminal, JUnit and the summary of a job."""
    return [
        Case(check.scene, _group(check), check.name, check.status, message(check)) for check in gate.checks
    ]


def message(check: Check) -> str:
    """Return where a check found which deviation, in one line; empty where there is none."""
    if check.deviation is None:
        return ""
    if check.name == "thresholds":
        return (
            "comparison/accuracy/thresholds.toml is not what the baseline was made with: its numbers change "
            "only together with newly measured rates of false alarms and of detected faults"
        )
    where = "" if check.run is None else f"{_group(check)}, "
    return f"{where}scene {check.scene!r}: {_deviation(check)}"


def notes(gate: Gate) -> list[str]:
    """Return the remarks about what is not a regression."""
    remarks = []
    if gate.platform is not None:
        there, here = gate.platform
        remarks.append(f"the baseline was made on {there}; this is {here}")
    if gate.versions:
        versions = (
            f"{name} {there or 'none'}, here {here or 'none'}"
            for name, (there, here) in gate.versions.items()
        )
        remarks.append(f"the baseline was made with {'; '.join(versions)}")
    if remarks:
        remarks.append(f"counters are therefore compared within {COUNTERS_ELSEWHERE:.0%} and not exactly")
    for excused in gate.excused:
        one = excused.channels == 1
        deviate = "1 channel deviates" if one else f"{excused.channels} channels deviate"
        remarks.append(
            f"{' '.join(excused.run)}, scene {excused.scene!r}: {deviate} no more than "
            f"{excused.neighbours} runs from neighbouring starts do here; "
            f"{'its' if one else 'their'} thresholds are too small"
        )
    changed = "its numbers are not those that the baseline was made with"
    return remarks + [f"scene {name!r}: {changed}" for name in gate.rewritten]


def summary(gate: Gate) -> str:
    """Return in one sentence what the checks come to."""
    checked = sum(check.status != "skipped" for check in gate.checks)
    if gate.regressions:
        return f"{len(gate.regressions)} of {checked} checks failed: a model deviates from its baseline"
    return f"All {checked} checks passed: both models match their baseline"


def _group(check: Check) -> str:
    if check.run is not None:
        return " ".join(check.run)
    return "comparison" if check.name == "thresholds" else check.name


def _deviation(check: Check) -> str:
    name = check.name
    match check.deviation:
        case SceneGone(source):
            return f"{source!r} of the baseline is neither a shipped scene nor a file"
        case RunFailed(job, outcome):
            return describe(job, outcome)
        case Changed(values):
            what = {"settings": "setting", "counters": "counter"}[name]
            return "; ".join(
                f"the {what} {key} is {_or_missing(now)}, in the baseline {_or_missing(before)}"
                for key, (now, before) in values.items()
            )
        case Excited(extent):
            channel = channels()[name]
            return (
                f"in {name} nothing happened in the baseline, its range was below {channel.floor:g} "
                f"{channel.unit}; now it is {extent:.3g} {channel.unit}"
            )
        case NoSample(time):
            return f"{name} has no sample at t = {time:g} s, where the baseline has a checkpoint"
        case Moved(value, worst, off, points):
            unit = channels()[name].unit
            return (
                f"{name} at t = {worst.time:g} s is {value:.15g} {unit}, in the baseline {worst.value:.15g} "
                f"{unit}: off by {abs(value - worst.value):.2g} {unit}, the threshold is "
                f"{worst.threshold:.2g} {unit} ({off} of {points} checkpoints are off)"
            )
        case Lack.PREDICTABLE:
            return f"{name} has no predictable sample at which something happens"
        case Lack.PRESENT if name == "run":
            return "the baseline has this run, the scene does not any more"
        case Lack.PRESENT:
            return f"the channel {name} is in the baseline and not in the run"
    return {
        "scene": "there is no baseline of it; sixbar gate SCENE --update makes one",
        "run": "there is no baseline of this run; sixbar gate --update makes one",
    }.get(name, f"the channel {name} has no baseline; sixbar gate --update makes one")


def _or_missing(value: object) -> object:
    return "missing" if value is None else value
