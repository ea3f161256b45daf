"""Three or more models: the verdicts of all pairs taken together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

Pair = tuple[str, str]


@dataclass(frozen=True)
class Standing:
    """Position of the models of a scene to each other.

    Attributes
    ----------
    outcome
        "agree": all pairs; "outlier": one model differs from all others, which agree; "differ": pairs differ
        and there is no outlier; "undecided": a pair is indeterminate; "cannot compare": fewer than two models
        can be compared.
    outlier
        The model that differs from all others; else empty.
    compared, left_out
        Models that can be compared with another one, and those that cannot.
    verdicts
        Of the pairs of those that can be compared.
    """

    outcome: str
    outlier: str
    compared: tuple[str, ...]
    left_out: tuple[str, ...]
    verdicts: Mapping[Pair, str]


def pairs(models: Sequence[str]) -> list[Pair]:
    """Return all pairs of the models, in their order."""
    return list(combinations(models, 2))


def standing(models: Sequence[str], verdicts: Mapping[Pair, str]) -> Standing:
    """Judge the verdicts of all `pairs` of three or more models.

    A model that cannot be compared with any other is left out of the judgement.
    """
    compared = tuple(
        model
        for model in models
        if any(model in pair and verdict != "cannot compare" for pair, verdict in verdicts.items())
    )
    left_out = tuple(model for model in models if model not in compared)
    counted = {pair: verdicts[pair] for pair in pairs(compared)}
    outlier = next((model for model in compared if _is_outlier(model, compared, counted)), "")
    values = set(counted.values())
    if not compared:
        outcome = "cannot compare"
    elif values == {"agree"}:
        outcome = "agree"
    elif outlier:
        outcome = "outlier"
    else:
        outcome = "differ" if values <= {"agree", "differ"} else "undecided"
    return Standing(outcome, outlier, compared, left_out, counted)


def _is_outlier(model: str, compared: Sequence[str], verdicts: Mapping[Pair, str]) -> bool:
    """Return whether a model differs from all others, which agree; of two models neither is an outlier."""
    return len(compared) > 2 and all(
        verdict == ("differ" if model in pair else "agree") for pair, verdict in verdicts.items()
    )
