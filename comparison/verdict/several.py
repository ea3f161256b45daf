"""Three or more models: the verdicts of all pairs taken together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

Pair = tuple[str, str]


@dataclass(frozen=True)
class Standing:
    """Position of the models of a scene to each other.

    ``outcome``: "agree", all pairs; "outlier", one model differs from all others, which agree; "differ"
    without an outlier; "undecided", a pair is indeterminate; "cannot compare", fewer than two models can be
    compared.
    """

    outcome: str
    outlier: str
    compared: tuple[str, ...]
    left_out: tuple[str, ...]  # cannot be compared with any other model
    verdicts: Mapping[Pair, str]  # of the pairs of those compared


def pairs(models: Sequence[str]) -> list[Pair]:
    """Return all pairs of the models, in their order."""
    return list(combinations(models, 2))


def standing(models: Sequence[str], verdicts: Mapping[Pair, str]) -> Standing:
    """Judge the verdicts of all `pairs` of three or more models."""
    comparable = {
        model for pair, verdict in verdicts.items() if verdict != "cannot compare" for model in pair
    }
    compared = tuple(model for model in models if model in comparable)
    left_out = tuple(model for model in models if model not in comparable)
    counted = {pair: verdicts[pair] for pair in pairs(compared)}
    outlier, values = "", set(counted.values())
    for model in compared if len(compared) > 2 else ():  # of two neither is one
        if all(verdict == ("differ" if model in pair else "agree") for pair, verdict in counted.items()):
            outlier = model
    if not compared:
        outcome = "cannot compare"
    elif values == {"agree"}:
        outcome = "agree"
    elif outlier:
        outcome = "outlier"
    else:
        outcome = "differ" if values <= {"agree", "differ"} else "undecided"
    return Standing(outcome, outlier, compared, left_out, counted)
