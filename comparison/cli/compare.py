"""``sixbar compare``: any two tables, and the further runs that give their uncertainty."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from comparison.cli.console import print_json, saved, say, warn, wrapped
from comparison.cli.options import REPORTS, AllowIndeterminate, AsJson, OfScene, OutFolder
from comparison.cli.pages import write_page

if TYPE_CHECKING:
    from comparison.tables.table import Table
    from comparison.verdict.recorded import Recorded

_File = Annotated[Path, typer.Argument(hidden=True)]
_Finer = Annotated[Path | None, typer.Option(metavar="FILE", help="The run at a finer setting.")]
_Coarser = Annotated[Path | None, typer.Option(metavar="FILE", help="The run at a coarser setting.")]
_Starts = Annotated[
    list[Path] | None,
    typer.Option(help="A run from a moved start; repeat for several.", metavar="FILE"),
]
_Refinement = Annotated[
    str | None,
    typer.Option(
        metavar="FACTOR,ORDER", help="Factor between two settings, order of the error; default 2,2."
    ),
]


def compare(
    a: _File,
    b: _File,
    scene: OfScene = None,
    tolerance: Annotated[
        float | None,
        typer.Option(metavar="X", help="Allowed difference, as a share of each channel's scale."),
    ] = None,
    share: Annotated[
        float, typer.Option(metavar="X", help="Share of the samples that must be within the tolerance.")
    ] = 1.0,
    time_tolerance: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", help="By which either table may be early or late; default 0."),
    ] = None,
    mapping: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="TOML file that assigns another program's columns to channels."),
    ] = None,
    at_events: Annotated[
        str | None, typer.Option(metavar="left|right|both", help="Which rows of a repeated time count.")
    ] = None,
    finer_a: _Finer = None,
    finer_b: _Finer = None,
    coarser_a: _Coarser = None,
    coarser_b: _Coarser = None,
    perturbed_a: _Starts = None,
    perturbed_b: _Starts = None,
    refinement_a: _Refinement = None,
    refinement_b: _Refinement = None,
    period: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS", help="Period of the motion; by default the scene's, else the tables' span."
        ),
    ] = None,
    out: OutFolder = None,
    json: AsJson = False,
    allow_indeterminate: AllowIndeterminate = False,
) -> int:
    """Compare any two tables, also of other programs.

    A, B: .csv, .parquet, .mat, .xlsx, or text of another program. A finer run of each, better with coarser
    and perturbed ones, gives their numerical uncertainty, by which they are judged as by `sixbar validate`.
    Else a tolerance decides; without one: metrics and "indeterminate".
    """
    from comparison.cli.verdicts import channel_lines, verdict_lines
    from comparison.files import check_folder
    from comparison.scene import command_line, load_scene
    from comparison.tables.foreign import AT_EVENTS, read_tables
    from comparison.tables.mapping import load_mapping
    from comparison.verdict.compare import recorded_scene
    from comparison.verdict.recorded import compare_recorded
    from comparison.verdict.results import EXIT_CODES, exit_code
    from comparison.words.record import as_mapping
    from comparison.words.verdicts import shift_line

    if tolerance is not None and not 0 < tolerance < float("inf"):
        raise typer.BadParameter(f"--tolerance {tolerance:g} must be a positive number")
    if not 0 < share <= 1:
        raise typer.BadParameter(f"--share {share:g} must be above 0 and at most 1")
    if time_tolerance is not None and not 0 <= time_tolerance < float("inf"):
        raise typer.BadParameter(f"--time-tolerance {time_tolerance:g} must be zero or a positive number")
    if period is not None and not 0 < period < float("inf"):
        raise typer.BadParameter(f"--period {period:g} must be a positive number")
    if at_events is not None and at_events not in AT_EVENTS:
        raise typer.BadParameter(f"--at-events {at_events!r} must be one of {', '.join(AT_EVENTS)}")
    folder = check_folder(out or REPORTS / "compare")
    rules = None if mapping is None else load_mapping(mapping)
    sides: dict[str, dict[str, list[Path]]] = {
        "a": _runs(a, finer_a, coarser_a, perturbed_a),
        "b": _runs(b, finer_b, coarser_b, perturbed_b),
    }
    paths = [(side, path) for side, runs in sides.items() for files in runs.values() for path in files]
    tables, left_out = read_tables([path for _, path in paths], [side for side, _ in paths], rules, at_events)
    read = iter(tables)
    first = _recorded(sides["a"], read, refinement_a, "--refinement-a")
    second = _recorded(sides["b"], read, refinement_b, "--refinement-b")
    loaded, warnings = (
        (load_scene(scene), ()) if scene is not None else recorded_scene(first.base, second.base)
    )
    gate = {**({} if loaded is None else loaded.gate), **({} if rules is None else rules.gate)}
    limits = {
        "--tolerance": tolerance is not None,
        "--time-tolerance": bool(time_tolerance),
        "--share": share < 1,
        "the gate": bool(gate),
    }
    if tolerance is None and loaded is not None:
        tolerance = loaded.tolerance
    unused = _without_effect(limits, finer=finer_a is not None, tolerance=tolerance is not None)
    if time_tolerance is None and loaded is not None and loaded.time_tolerance:
        time_tolerance = loaded.time_tolerance
    options: dict[str, Any] = {
        "--scene": scene,
        "--mapping": mapping,
        "--tolerance": None if tolerance is None else f"{tolerance:g}",
        "--share": None if share == 1 else f"{share:g}",
        "--time-tolerance": time_tolerance,
        "--at-events": at_events,
        "--period": period,
        "--refinement-a": refinement_a,
        "--refinement-b": refinement_b,
    }
    further = [
        word
        for side, runs in sides.items()
        for kind, files in runs.items()
        if kind != "base"
        for path in files
        for word in (f"--{kind}-{side}", str(path))
    ]

    def command_with(**changes: str) -> str:
        given = {name: value for name, value in (options | changes).items() if value is not None}
        words = [word for name, value in given.items() for word in (name, str(value))]
        return command_line("compare", [str(a), str(b)], {}, [*words, *further])

    command = command_with()
    labels = (a.stem, b.stem) if a.stem != b.stem else (str(a), str(b))
    comparison = compare_recorded(
        first,
        second,
        scene=loaded,
        tolerance=tolerance,
        share=share,
        time_tolerance=time_tolerance or 0.0,
        gate=gate,
        period=period,
        labels=labels if labels[0] != labels[1] else (f"{a} (a)", f"{b} (b)"),
        command=command,
        warnings=(*left_out, *warnings, *unused),
        only=None if rules is None else rules.compare,
    )
    if tolerance is None and finer_a is None:
        comparison = replace(comparison, closer_command=command_with(**{"--tolerance": "0.01"}))
    lines = (*channel_lines(comparison), *wrapped(shift_line(comparison)))
    for line in (*lines, *verdict_lines([comparison], verbose=True)):
        typer.echo(line, err=json)  # with colours
    if json:
        print_json(as_mapping(comparison))
    say(str(saved(lambda folder: write_page([comparison], folder, command), folder)), err=json)
    warn(comparison.warnings)
    return exit_code([EXIT_CODES[comparison.verdict]], allow_indeterminate=allow_indeterminate)


def _without_effect(limits: Mapping[str, bool], *, finer: bool, tolerance: bool) -> list[str]:
    """Return warnings of given limits that decide nothing: beside finer runs, or without a tolerance.

    ``limits``: name -> whether it was given.
    """
    needs_tolerance = {"--time-tolerance", "--share"}
    names = [name for name, is_given in limits.items() if is_given]
    if finer:
        return [f"{name} has no effect: the uncertainty from finer runs decides" for name in names]
    names = [] if tolerance else [name for name in names if name in needs_tolerance]
    return [f"{name} has no effect without a tolerance" for name in names]


def _runs(
    base: Path, finer: Path | None, coarser: Path | None, perturbed: list[Path] | None
) -> dict[str, list[Path]]:
    """Return the files of one program by their part."""
    files: dict[str, list[Path | None]] = {
        "base": [base],
        "finer": [finer],
        "coarser": [coarser],
        "perturbed": [*(perturbed or [])],
    }
    return {kind: [path for path in paths if path is not None] for kind, paths in files.items()}


def _recorded(
    runs: dict[str, list[Path]], tables: Iterator[Table], refinement: str | None, option: str
) -> Recorded:
    from comparison.verdict.recorded import Recorded

    read = {kind: [next(tables) for _ in files] for kind, files in runs.items()}
    finer, coarser = (read[kind][0] if read[kind] else None for kind in ("finer", "coarser"))
    known = _factor_and_order(refinement, option)
    return Recorded(read["base"][0], finer, coarser, read["perturbed"], known)


def _factor_and_order(text: str | None, option: str) -> tuple[float, float] | None:
    if text is None:
        return None
    try:
        factor, order = map(float, text.split(","))
    except ValueError:
        factor, order = 0.0, 0.0
    if not (1 < factor < float("inf") and 0 < order < float("inf")):
        raise typer.BadParameter(f"{option} {text!r} must be a factor above 1 and an order, as in 2,4")
    return factor, order
