"""``sixbar compare``: any two tables, and the further runs that give their uncertainty."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from comparison.cli.console import saved, say, warn
from comparison.cli.layout import wrapped
from comparison.cli.options import REPORTS, AllowIndeterminate, OutFolder
from comparison.cli.pages import write_page

if TYPE_CHECKING:
    from comparison.tables.table import Table
    from comparison.verdict.recorded import Recorded

Finer = Annotated[Path | None, typer.Option(help="The run at a finer setting.", show_default=False)]
Coarser = Annotated[Path | None, typer.Option(help="The run at a coarser setting.", show_default=False)]
Starts = Annotated[
    list[Path] | None,
    typer.Option(help="A run from a moved start; repeat for several.", metavar="FILE"),
]
Refinement = Annotated[
    str | None,
    typer.Option(
        metavar="FACTOR,ORDER", help="Factor between two settings, order of the error; default 2,2."
    ),
]


def compare(
    a: Annotated[
        Path, typer.Argument(help="A table: .csv, .parquet, .mat, .xlsx, or text of another program.")
    ],
    b: Annotated[Path, typer.Argument(help="The other table.")],
    scene: Annotated[
        str | None, typer.Option(help="Scene of the tables; default: the one recorded beside both.")
    ] = None,
    tolerance: Annotated[
        float | None, typer.Option(help="Allowed difference, as a share of each channel's scale.")
    ] = None,
    share: Annotated[
        float, typer.Option(help="Share of the samples that must be within the tolerance.")
    ] = 1.0,
    mapping: Annotated[
        Path | None, typer.Option(help="TOML file that assigns another program's columns to channels.")
    ] = None,
    at_events: Annotated[
        str | None, typer.Option(metavar="left|right|both", help="Which rows of a repeated time count.")
    ] = None,
    finer_a: Finer = None,
    finer_b: Finer = None,
    coarser_a: Coarser = None,
    coarser_b: Coarser = None,
    perturbed_a: Starts = None,
    perturbed_b: Starts = None,
    refinement_a: Refinement = None,
    refinement_b: Refinement = None,
    period: Annotated[
        float | None,
        typer.Option(help="Period of the motion, s; default: the scene's, else the span of the tables."),
    ] = None,
    out: OutFolder = None,
    json: Annotated[Path | None, typer.Option(help="Also write the numbers to this file.")] = None,
    allow_indeterminate: AllowIndeterminate = False,
) -> int:
    """Compare any two tables, also of other programs.

    A finer run of each, better with coarser and perturbed ones, gives their numerical uncertainty, by which
    they are judged as by `sixbar validate`. Else a tolerance decides; without one: metrics and
    "indeterminate".
    """
    from comparison.cli.verdicts import channel_lines, verdict_lines
    from comparison.files import check_file, check_folder, write_json
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
    if period is not None and not 0 < period < float("inf"):
        raise typer.BadParameter(f"--period {period:g} must be a positive number")
    if at_events is not None and at_events not in AT_EVENTS:
        raise typer.BadParameter(f"--at-events {at_events!r} must be one of {', '.join(AT_EVENTS)}")
    folder = check_folder(out or REPORTS / "compare")
    json = None if json is None else check_file(json)
    rules = None if mapping is None else load_mapping(mapping)
    sides: dict[str, dict[str, Any]] = {
        "a": {"base": a, "finer": finer_a, "coarser": coarser_a, "perturbed": perturbed_a or []},
        "b": {"base": b, "finer": finer_b, "coarser": coarser_b, "perturbed": perturbed_b or []},
    }
    paths = [(side, path) for side, runs in sides.items() for path in _paths(runs)]
    tables, left_out = read_tables([path for _, path in paths], [side for side, _ in paths], rules, at_events)
    read = iter(tables)
    both = [
        _recorded(runs, read, refinement, f"--refinement-{side}")
        for (side, runs), refinement in zip(sides.items(), (refinement_a, refinement_b), strict=True)
    ]
    bases = both[0].base, both[1].base
    loaded, warnings = (load_scene(scene), ()) if scene is not None else recorded_scene(*bases)
    if tolerance is None and loaded is not None:
        tolerance = loaded.tolerance
    options: dict[str, Any] = {
        "--scene": scene,
        "--mapping": mapping,
        "--tolerance": None if tolerance is None else f"{tolerance:g}",
        "--share": None if share == 1 else f"{share:g}",
        "--at-events": at_events,
        "--period": period,
        "--refinement-a": refinement_a,
        "--refinement-b": refinement_b,
    }
    further = [
        part
        for side, runs in sides.items()
        for kind in ("finer", "coarser", "perturbed")
        for path in _paths({kind: runs[kind]})
        for part in (f"--{kind}-{side}", str(path))
    ]

    def command_with(**changes: str) -> str:
        given = {name: value for name, value in (options | changes).items() if value is not None}
        words = [part for name, value in given.items() for part in (name, str(value))]
        return command_line("compare", [str(a), str(b)], {}, [*words, *further])

    command = command_with()
    labels = (a.stem, b.stem) if a.stem != b.stem else (str(a), str(b))
    comparison = compare_recorded(
        *both,
        scene=loaded,
        tolerance=tolerance,
        share=share,
        period=period,
        labels=labels if labels[0] != labels[1] else (f"{a} (a)", f"{b} (b)"),
        command=command,
        warnings=(*left_out, *warnings),
        only=None if rules is None else rules.compare,
    )
    if tolerance is None and finer_a is None:
        comparison = replace(comparison, closer_command=command_with(**{"--tolerance": "0.01"}))
    for line in (*channel_lines(comparison), *wrapped(shift_line(comparison))):
        typer.echo(line)
    for line in verdict_lines([comparison], verbose=True):
        typer.echo(line)
    report = saved(lambda folder: write_page([comparison], folder, command), folder)
    if json is not None:
        numbers, name = as_mapping(comparison), json.name
        saved(lambda folder: write_json(numbers, folder / name), json.parent)
    say(str(report))
    warn(comparison.warnings)
    return exit_code([EXIT_CODES[comparison.verdict]], allow_indeterminate=allow_indeterminate)


def _paths(runs: dict[str, Any]) -> list[Path]:
    """Return the files of one program, in the order of its runs."""
    return [
        path
        for files in runs.values()
        for path in (files if isinstance(files, list) else [files])
        if path is not None
    ]


def _recorded(runs: dict[str, Any], tables: Any, refinement: str | None, option: str) -> Recorded:
    from comparison.verdict.recorded import Recorded

    def table(path: Path | None) -> Table | None:
        return None if path is None else next(tables)

    base = next(tables)
    finer, coarser = table(runs["finer"]), table(runs["coarser"])
    perturbed = [next(tables) for _ in runs["perturbed"]]
    return Recorded(base, finer, coarser, perturbed, _factor_and_order(refinement, option))


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
