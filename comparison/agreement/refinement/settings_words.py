"""The settings of a scene as lines: a table, and the cheapest command for each error."""

from __future__ import annotations

from math import isnan

from comparison.accuracy.sweeps import SETTINGS
from comparison.agreement.refinement.candidates import Timed
from comparison.agreement.refinement.work_precision import DECADES, WorkPrecision

HEADINGS = ("setting", "error (m)", "time (s)", "front")


def title(row: Timed) -> str:
    """Return model, formulation and setting."""
    of = row.candidate
    return f"{of.model} {of.formulation}, {of.key.rpartition('.')[2]} {of.setting:g}"


def basis(found: WorkPrecision) -> str:
    """Return what the errors are distances from, and on which part of the run."""
    if found.exact is None or found.confirming is None:
        return "no two runs have a result: errors are unknown"
    exact, other = title(found.exact), title(found.confirming)
    within = f"{other} and neighbouring starts are" if found.neighbours else f"{other} is"
    line = f"errors of slider_x against {exact}, where {within} within {found.resolution / 3:.1g} m of it"
    line += f": {found.coverage(found.resolution):.1%} of the run"
    return line if found.confirmed else f"{line}; no run of the other model confirms it"


def table(found: WorkPrecision) -> list[tuple[str, str, str, str]]:
    """Return a row a setting below the headings."""
    front = found.front
    rows = [HEADINGS]
    for row in sorted(found.rows, key=_place):
        error, mark = found.error(row), "*" if row in front else ""
        if row.x is None:
            rows.append((title(row), "", "", row.status))
        else:
            rows.append((title(row), "" if isnan(error) else f"{error:.1e}", f"{row.seconds:.3g}", mark))
    return rows


def _place(row: Timed) -> tuple[int, float]:
    return list(SETTINGS).index(row.candidate.formulation), -row.candidate.setting


def commands(found: WorkPrecision) -> list[tuple[str, str]]:
    """Return what was seen to hold: errors with their part of the run, and the cheapest command."""
    cheapest = {error: row for error in DECADES if (row := found.cheapest(error)) is not None}
    held: dict[str, list[float]] = {}
    for error, row in cheapest.items():
        held.setdefault(command(row), []).append(error)
    lines = []
    for words, errors in held.items():
        row = cheapest[errors[-1]]
        ends = errors[0], errors[-1]
        span, part = (
            " to ".join(dict.fromkeys(texts))
            for texts in (
                [f"{error:.0e}" for error in ends],
                [f"{found.coverage(error):.0%}" for error in ends],
            )
        )
        lines.append((f"{span} m on {part} of the run, {row.seconds:.2g} s of processor time", words))
    return lines


def command(row: Timed) -> str:
    """Return the command that runs a setting."""
    scene = row.candidate.scene
    return scene.command("run", "--model", row.candidate.model, "--out", f"{scene.name}.csv")
