"""Comparison of a report with an earlier one of the same scenes: verdicts and printed numbers that moved."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import Any, NamedTuple

from comparison.files import contents, reading
from comparison.formatting import number, percent
from comparison.scene.keys import flat
from comparison.tables.table import TableError

_LARGEST = 100_000_000  # bytes of the results of all scenes, which have some 150 kB each
_FEW = 5  # changed keys and versions in one sentence


class Move(NamedTuple):
    """Verdict, |E| over its limit and coverage, in the digits of a report; one at least has moved.

    They are of a scene at one tier if ``channel`` is "". A side without an entry has the verdict "none".
    """

    scene: str
    tier: str
    channel: str
    before: tuple[str, str, str]
    now: tuple[str, str, str]


@dataclass(frozen=True)
class Since:
    """Differences of a report from an earlier one."""

    earlier: str  # file of its results, with the time and the code of the report where they are recorded
    compared: int  # scenes at a tier, and their channels, that both reports or one of them have
    moves: tuple[Move, ...]  # verdicts that have changed first
    changes: tuple[str, ...]  # keys of the scenes and versions of the programs
    new: tuple[str, ...]  # scenes of the new report alone


def earlier_report(path: Path, names: Sequence[str]) -> dict[str, Any]:
    """Read ``summary.json`` of an earlier report, or of its folder.

    Raises
    ------
    comparison.tables.table.TableError
        Not such a file, or it has none of the scenes with these names.
    """
    path = path / "summary.json" if path.is_dir() else path
    with reading(path, TableError, "JSON"):
        report = json.loads(contents(path, _LARGEST))
        try:
            scene_names = {key[0] for key in _entries(report)}
        except (AttributeError, KeyError, TypeError):
            raise TableError("is not the results of a report by sixbar validate or judge") from None
        if scene_names.isdisjoint(names):
            raise TableError(f"has no scene {' or '.join(map(repr, names))}")
    return dict(report, path=str(path))


def compare_reports(before: Mapping[str, Any], now: Mapping[str, Any]) -> Since:
    """Return the moves from one report to the next, both as `earlier_report` returns them."""
    old, new = _entries(before), _entries(now)
    tiers = {key[:2] for key in old} & {key[:2] for key in new}
    keys = [key for key in dict.fromkeys([*new, *old]) if key[:2] in tiers]
    moves = [Move(*key, old.get(key, _NONE), new.get(key, _NONE)) for key in keys]
    moves = [move for move in moves if any(a and a != b for a, b in zip(move.before, move.now, strict=True))]
    moves.sort(key=lambda move: move.before[0] == move.now[0])
    scenes = [{scene["name"]: scene for scene in report["scenes"]} for report in (before, now)]
    both = [(scenes[0][name], scene) for name, scene in scenes[1].items() if name in scenes[0]]
    changes = [text for pair in both for text in _changes(*pair)]
    origin = before.get("made") or {}
    return Since(
        ", ".join(filter(None, [before["path"], origin.get("time"), origin.get("code")])),
        len(keys),
        tuple(moves),
        tuple(dict.fromkeys(changes)),
        tuple(name for name in scenes[1] if name not in scenes[0]),
    )


_NONE = ("none", "", "")


def _entries(report: Mapping[str, Any]) -> dict[tuple[str, str, str], tuple[str, str, str]]:
    """Return scene, tier and channel -> verdict, ratio and coverage as a report prints them."""
    return {
        (scene["name"], tier["tier"], channel): (
            each["verdict"],
            _text(each, "ratio"),
            _text(each, "coverage"),
        )
        for scene in report["scenes"]
        for tier in filter(None, (scene, scene["tight"]))
        for channel, each in {"": tier, **tier["channels"]}.items()
    }


def _text(entry: Mapping[str, Any], key: str) -> str:
    """Return a number as reports print it; empty if the version that wrote the report has none."""
    value = nan if entry.get(key) is None else float(entry[key])
    return "" if key not in entry else percent(value) if key == "coverage" else number(value, 2)


def _changes(before: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """Yield the differences between the runs of a scene: keys of the scene, versions."""
    for label in now["labels"]:
        runs = [report.get("provenance", {}).get(label, {}) for report in (before, now)]
        for part in ("scene", "versions"):
            old, new = (flat(run.get(part) or {}) for run in runs)
            for key in dict.fromkeys([*old, *new]) if old and new else ():
                if old.get(key) != new.get(key) and not key.startswith("scene."):  # name and texts
                    yield f"{key} {json.dumps(old.get(key))}, now {json.dumps(new.get(key))}"


def change_text(before: str, now: str) -> str:
    """Return "0.40 → 0.52", or the text itself where it has not moved."""
    return f"{before} → {now}" if before and before != now else now


def sentences(result: Since) -> list[str]:
    """Return the number of moves, and other differences from the earlier report."""
    count, verdicts = len(result.moves), sum(move.before[0] != move.now[0] for move in result.moves)
    text = f"of {result.compared} results {count} have moved, {verdicts or 'none'} of them in the verdict"
    lines = [
        f"Since {result.earlier}: {text if count else 'nothing has moved'}. Compared as printed: verdict, "
        "|E| over its limit and coverage of each scene and channel."
    ]
    if result.changes:
        rest = len(result.changes) - _FEW
        items = [*result.changes[:_FEW], *([f"{rest} more"] if rest > 0 else [])]
        lines.append(f"Not as before: {'; '.join(items)}.")
    if result.new:
        lines.append(f"Not in the earlier report: {', '.join(result.new)}.")
    return lines


def rows(result: Since) -> list[tuple[str, ...]]:
    """Return a heading, and the moves of each scene and tier and of each changed verdict."""
    moves = [move for move in result.moves if not move.channel or move.before[0] != move.now[0]]
    return [
        ("since then", "tier", "channel", "verdict", "|E|/limit", "coverage"),
        *((*move[:3], *map(change_text, move.before, move.now)) for move in moves),
    ]
