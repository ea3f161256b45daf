"""The verdicts of the shipped scenes on record: ``verdicts.toml``, written by ``make reports``."""

import json
import tomllib
from collections.abc import Iterable, Mapping
from importlib.resources import files
from typing import Any, NamedTuple

from comparison.scene import Scene
from comparison.verdict.results import SceneComparison

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
    """Return what is recorded of scenes and their comparisons, made with which machine on which date."""
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
    """Return the verdicts that are not those on record, of scenes that are as they are shipped."""
    return [
        Departure(scene.name, tier.tier, tier.verdict, known[tier.tier])
        for scene, comparison in zip(scenes, comparisons, strict=True)
        if (known := record["scenes"].get(scene.name, {})).get("hash") == scene.hash
        for tier in comparison.tiers
        if tier.verdict != known.get(tier.tier, tier.verdict)
    ]
