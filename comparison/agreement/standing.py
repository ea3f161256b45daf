"""Who stands alone: the verdicts of all pairs of several models taken together."""

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
        "agree": all pairs; "alone": one model differs from all others, which agree; "differ": pairs differ
        and no model stands alone; "undecided": a pair is indeterminate; "cannot compare": fewer than two
        models can be compared.
    alone
        The model that stands alone; else empty.
    sentence
        The same in words, with the models that cannot be compared.
    """

    outcome: str
    alone: str
    sentence: str


def pairs(models: Sequence[str]) -> list[Pair]:
    """Return all pairs of the models, in their order."""
    return list(combinations(models, 2))


def standing(models: Sequence[str], verdicts: Mapping[Pair, str]) -> Standing:
    """Judge the verdicts of all `pairs` of three or more models.

    A model that cannot be compared with any other is left out of the judgement.
    """
    compared = [
        model
        for model in models
        if any(model in pair and verdict != "cannot compare" for pair, verdict in verdicts.items())
    ]
    without = [model for model in models if model not in compared]
    outcome, alone, sentence = _judged(compared, {pair: verdicts[pair] for pair in pairs(compared)})
    if without:
        sentence += f"; {_listed(without)} cannot be compared"
    return Standing(outcome, alone, f"{sentence[0].upper()}{sentence[1:]}.")


def _judged(models: Sequence[str], verdicts: Mapping[Pair, str]) -> tuple[str, str, str]:
    if not models:
        return "cannot compare", "", "no two models can be compared"
    words: dict[str, list[Pair]] = {}
    for pair, verdict in verdicts.items():
        words.setdefault(verdict, []).append(pair)
    if set(words) == {"agree"}:
        return "agree", "", f"{_listed(models)} agree" if len(models) == 2 else f"all {len(models)} agree"
    differing = words.get("differ", [])
    # Of two models that differ neither stands alone: there is no third opinion.
    for model in models if len(models) > 2 else ():
        own = [pair for pair in verdicts if model in pair]
        others = [pair for pair in verdicts if model not in pair]
        if all(verdicts[pair] == "differ" for pair in own) and all(
            verdicts[pair] == "agree" for pair in others
        ):
            rest = _listed([other for other in models if other != model])
            return "alone", model, f"{model} stands alone: it differs from {rest}, which agree"
    open_pairs = [pair for verdict in ("indeterminate", "cannot compare") for pair in words.get(verdict, [])]
    parts = [f"{_listed(pair)} differ" for pair in differing]
    parts += [f"{_listed(pair)}: {verdicts[pair]}" for pair in open_pairs]
    parts += [f"{_listed(pair)} agree" for pair in words.get("agree", [])]
    head = "no model stands alone" if not open_pairs else "undecided"
    return "undecided" if open_pairs else "differ", "", f"{head}: {'; '.join(parts)}"


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
