"""The verdicts of the shipped scenes on record: ``verdicts.toml``, written by ``make reports``."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Mapping
from importlib.resources import files
from typing import Any

from comparison.agreement.results import SceneComparison
from comparison.scene import Scene

_HEAD = """\
# The verdicts of `sixbar validate` on the shipped scenes, those of the README. Written by `make reports`.
#
# A scene: `hash`, of everything that can change a result; its verdict at each tier.
"""


def as_toml(scenes: Iterable[Scene], comparisons: Iterable[SceneComparison], made: Mapping[str, str]) -> str:
    """Return what is recorded of the scenes.

    Parameters
    ----------
    scenes, comparisons
        In the same order.
    made
        ``"machine"``, with its versions, and ``"date"``.
    """
    # A string of JSON is one of TOML too.
    lines = [_HEAD, "[made]", *(f"{key} = {json.dumps(value)}" for key, value in made.items())]
    for scene, comparison in zip(scenes, comparisons, strict=True):
        lines += ["", f'[scenes."{scene.name}"]', f'hash = "{scene.hash}"']
        lines += [f'{tier.tier} = "{tier.verdict}"' for tier in comparison.tiers]
    return "\n".join(lines) + "\n"


def departures(
    scenes: Iterable[Scene], comparisons: Iterable[SceneComparison], record: Mapping[str, Any] | None = None
) -> str:
    """Say in one line which verdicts are not those on record; nothing where all are.

    A scene counts only as it is shipped: its hash is the one on record.

    Parameters
    ----------
    scenes, comparisons
        In the same order, at the scenes' own settings.
    record
        Of the form of ``verdicts.toml``, which is the default.
    """
    if record is None:
        record = tomllib.loads(files("comparison.agreement").joinpath("verdicts.toml").read_text("utf-8"))
    messages = []
    for scene, comparison in zip(scenes, comparisons, strict=True):
        known = record["scenes"].get(scene.name, {})
        if known.get("hash") != scene.hash:
            continue
        messages += [
            f"{scene.name}, {tier.tier}: {tier.verdict}, not {known[tier.tier]}"
            for tier in comparison.tiers
            if tier.verdict != known.get(tier.tier, tier.verdict)
        ]
    made = record["made"]
    where = f"(on {made['machine']}; {made['date']})"
    return f"not the verdicts on record {where}: {'; '.join(messages)}" if messages else ""
