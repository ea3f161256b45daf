"""``sixbar validate`` with three or more models: each pair by itself, then who stands alone."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from comparison.cli.console import say
from comparison.cli.layout import wrapped

OnePair = Callable[[str, Path], int]
"""Validates two models, "a,b", writes their report into a folder and returns the exit code."""


def validate_pairs(models: Sequence[str], folder: Path, command: str, one: OnePair) -> int:
    """Validate all pairs of models, write the page of all of them, and return the worst exit code.

    The runs of a model are the same in each of its pairs: all but the first time they come from the cache.
    """
    from comparison.execution.worker_process import kept_workers
    from comparison.files import check_folder, write_json
    from comparison.report.pairwise import write_pairwise
    from comparison.verdict.results import exit_code
    from comparison.verdict.several import pairs
    from comparison.words.verdicts import standing as sentence

    folder = check_folder(folder)
    codes, found = [], {}
    with kept_workers():
        for pair in pairs(models):
            say(f"{pair[0]} and {pair[1]}:")
            own = folder / "-".join(pair)
            codes.append(one(",".join(pair), own))
            found[pair] = json.loads((own / "summary.json").read_text("utf-8"))["scenes"]
    rows = _rows(models, found)
    code = exit_code(codes)
    page = write_pairwise(rows, folder, models=models, command=command)
    scenes = [
        {
            "name": row.name,
            "outcome": row.standing.outcome,
            "outlier": row.standing.outlier,
            "sentence": sentence(row.standing),
            "verdicts": {" and ".join(result.pair): result.found["verdict"] for result in row.results},
        }
        for row in rows
    ]
    write_json(
        {"command": command, "exit_code": code, "models": models, "scenes": scenes}, folder / "summary.json"
    )
    width = max(len(row.name) for row in rows)
    say("all together:")
    for row in rows:
        for line in wrapped(sentence(row.standing), first=f"{row.name:<{width}}  "):
            say(line)
    say(str(page))
    return code


def _rows(models: Sequence[str], found: dict[tuple[str, str], list[dict[str, Any]]]) -> list[Any]:
    from comparison.report.pairwise import PairResult, Row
    from comparison.verdict.several import standing

    rows = []
    for scenes in zip(*found.values(), strict=True):
        results = [PairResult(pair, scene) for pair, scene in zip(found, scenes, strict=True)]
        verdicts = {result.pair: result.found["verdict"] for result in results}
        rows.append(Row(scenes[0]["name"], scenes[0]["title"], standing(models, verdicts), results))
    return rows
