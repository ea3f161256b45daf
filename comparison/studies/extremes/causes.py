"""Reasons of a verdict as data: a cause with its numbers, of which the sentence is made once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

from comparison.formatting import number, quantity


class Cause(Enum):
    """A kind of reason: its sentence, and a name without numbers by which runs are put together.

    The earlier of several causes of one run names its kind.
    """

    UNEXPLAINED = ("not explained", "not explained")
    UNRESOLVED = (
        "two starts {hair} apart end {apart} apart: no setting resolves what decides there",
        "no setting resolves what decides",
    )
    TOO_COARSE = (
        "too coarse a setting for this scene: at the next finer one {error}",
        "too coarse a setting for the scene",
    )
    EDGE = ("at the edge of stopping: at the next finer setting {status}", "at the edge of stopping")
    LITERAL = (
        "the literal switch creates energy: no run converges (study contact-laws)",
        "the literal switch creates energy",
    )
    FEW_STEPS = ("a contact lasts {steps} steps", "few steps a contact")
    FEWER_STEPS = ("{steps} steps a contact, {usual} in the base scene", "few steps a contact")
    MAGNIFIED = ("the scene magnifies {ratio} times as much as the base scene", "the scene magnifies")
    TOGETHER = (
        "leaves the exact motion at {lasted} of the cycle, where {others} leave it too: it magnifies more "
        "there than near starts show",
        "the scene magnifies",
    )
    STRICT_APART = ("the strict runs are {apart} apart themselves", "the strict runs differ too")
    SCATTERED = ("within the {scatter} times by which single runs scatter", "scatter of single runs")
    NO_BOUND = ("no error bound is on record for so coarse a setting", "")
    NEWTON_ERROR = ("Newton's iteration ends with an error of its own", "")
    AS_IN_BASE = ("errs {ratio} times its bound in the base scene too", "")
    UNCONFIRMED = ("{method}: {ending}", "")
    COARSE_TOLERANCE = ("{message}", "tolerance too coarse")
    NO_MECHANISM = ("{message}", "no such mechanism")
    OUT_OF_TIME = ("{status}, stopped after {limit} units", "{status}")
    ENDED = ("{status}", "{status}")
    JAMMED = ("friction this large lets a corner dig itself into its wall", "(friction may jam it)")

    def __init__(self, sentence: str, kind: str) -> None:
        self.sentence = sentence
        self.kind = kind


_UNITS = {"hair": "m", "apart": "m", "error": "m"}


@dataclass(frozen=True)
class Reason:
    """A cause with its numbers (m, s, ratios) and names."""

    cause: Cause
    values: Mapping[str, float | str] = field(default_factory=dict)

    def __str__(self) -> str:
        return self.cause.sentence.format(**self._written())

    @property
    def kind(self) -> str:
        """Its name without numbers of its own."""
        return self.cause.kind.format(**self._written())

    def _written(self) -> dict[str, str]:
        return {name: _write(name, value) for name, value in self.values.items()}


def kind(why: Sequence[Reason]) -> str:
    """Return the kind of a run's reasons: that of the first cause, and whether friction may jam it."""
    order = list(Cause)
    ranked = sorted(why, key=lambda each: order.index(each.cause))
    jammed = [each for each in ranked if each.cause is Cause.JAMMED]
    return " ".join(each.kind for each in [*ranked[:1], *jammed])


def _write(name: str, value: float | str) -> str:
    if isinstance(value, str):
        return value
    return quantity(value, _UNITS[name], 2) if name in _UNITS else number(value, 2)
