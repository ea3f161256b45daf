"""Several verdicts together: all pairs of several models, and the shipped scenes against their record."""

import json
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from itertools import combinations
from typing import Any, NamedTuple

from comparison.scene import Scene
from comparison.verdict.results import SceneComparison

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


# ---- the verdicts of the shipped scenes on record: ``verdicts.toml``, written by ``make reports``

_HEAD = """\
# The verdicts of `sixbar validate` on the shipped scenes, those of the README. Written by `make reports`.
#
# A scene: `hash`, of everything that can change a result; its verdict at each tier.
"""


class Departure(NamedTuple):
    """A verdict that is not the one on record."""

    scene: str
    tier: str
    verdict: str
    recorded: str


def as_toml(scenes: Iterable[Scene], comparisons: Iterable[SceneComparison], made: Mapping[str, str]) -> str:
    """Return the record of scenes and their comparisons; ``made`` has the machine and the date."""
    # A string of JSON is one of TOML too.
    lines = [_HEAD, "[made]", *(f"{key} = {json.dumps(value)}" for key, value in made.items())]
    for scene, comparison in zip(scenes, comparisons, strict=True):
        lines += ["", f'[scenes."{scene.name}"]', f'hash = "{scene.hash}"']
        lines += [f'{tier.tier} = "{tier.verdict}"' for tier in comparison.tiers]
    return "\n".join(lines) + "\n"


def verdicts_record() -> dict[str, Any]:
    """Read ``verdicts.toml``: ``made`` (machine and date) and ``scenes``."""
    return tomllib.loads(files("comparison.verdict").joinpath("verdicts.toml").read_text("utf-8"))


def departures(
    scenes: Iterable[Scene], comparisons: Iterable[SceneComparison], record: Mapping[str, Any]
) -> list[Departure]:
    """Return the verdicts that are not those on record, of scenes whose numbers are as shipped."""
    return [
        Departure(scene.name, tier.tier, tier.verdict, known[tier.tier])
        for scene, comparison in zip(scenes, comparisons, strict=True)
        if (known := record["scenes"].get(scene.name, {})).get("hash") == scene.hash
        for tier in comparison.tiers
        if tier.verdict != known.get(tier.tier, tier.verdict)
    ]
