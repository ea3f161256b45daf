"""``sixbar compare``: any two tables, and the further runs that give their uncertainty."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from comparison.cli import options
from comparison.cli.console import print_json, say, warn, wrapped

_File = Annotated[Path, typer.Argument(hidden=True)]
_Coarser = Annotated[Path | None, options.option("FILE", "The run at a coarser setting.")]
_Starts = Annotated[
    list[Path] | None, options.option("FILE", "A run from a moved start; repeat for several.")
]
_Refinement = Annotated[
    str | None,
    options.option("FACTOR,ORDER", "Factor between two settings, order of the error; default 2,2."),
]


def compare(
    a: _File,
    b: _File,
    scene: options.OfScene = None,
    tolerance: Annotated[
        float | None, options.option("X", "Allowed difference, as a share of each channel's scale.")
    ] = None,
    share: Annotated[
        float, options.option("X", "Share of the samples that must be within the tolerance.")
    ] = 1.0,
    time_tolerance: Annotated[
        float | None, options.option("SECONDS", "By which either table may be early or late; default 0.")
    ] = None,
    mapping: options.MappingFile = None,
    at_events: options.AtEvents = None,
    finer_a: options.Finer = None,
    finer_b: options.Finer = None,
    coarser_a: _Coarser = None,
    coarser_b: _Coarser = None,
    perturbed_a: _Starts = None,
    perturbed_b: _Starts = None,
    refinement_a: _Refinement = None,
    refinement_b: _Refinement = None,
    period: Annotated[
        float | None,
        options.option("SECONDS", "Period of the motion; by default the scene's, else the tables' span."),
    ] = None,
    out: options.OutFolder = None,
    json: options.AsJson = False,
    allow_indeterminate: options.AllowIndeterminate = False,
) -> int:
    """Compare any two tables, also of other programs.

    A, B: .csv, .parquet, .mat, .xlsx, or text of another program. A finer run of each, better with coarser
    and perturbed ones, gives their numerical uncertainty, by which they are judged as by `sixbar validate`.
    Else a tolerance decides; without one: metrics and "indeterminate".
    """
    from comparison.cli.results import channel_lines, verdict_lines, write_page
    from comparison.files import check_folder
    from comparison.scene import command_line, load_scene
    from comparison.tables.foreign import read_tables
    from comparison.tables.mapping import load_mapping
    from comparison.verdict.compare import recorded_scene
    from comparison.verdict.recorded import Recorded, compare_recorded
    from comparison.verdict.results import EXIT_CODES, exit_code
    from comparison.words.record import as_mapping
    from comparison.words.verdicts import shift_line

    options.check_positive("--tolerance", tolerance)
    if not 0 < share <= 1:
        raise typer.BadParameter(f"--share {share:g} must be above 0 and at most 1")
    if time_tolerance is not None and not 0 <= time_tolerance < float("inf"):
        raise typer.BadParameter(f"--time-tolerance {time_tolerance:g} must be zero or a positive number")
    options.check_positive("--period", period)
    folder = check_folder(out or options.REPORTS / "compare")
    rules = None if mapping is None else load_mapping(mapping)
    runs: list[tuple[str, str, Path | None]] = [
        *(("a", "base", a), ("a", "finer", finer_a), ("a", "coarser", coarser_a)),
        *(("a", "perturbed", path) for path in perturbed_a or ()),
        *(("b", "base", b), ("b", "finer", finer_b), ("b", "coarser", coarser_b)),
        *(("b", "perturbed", path) for path in perturbed_b or ()),
    ]
    files = [(side, kind, path) for side, kind, path in runs if path is not None]
    tables, left_out = read_tables(
        [path for *_, path in files], [side for side, *_ in files], rules, at_events
    )

    def recorded(side: str, refinement: str | None) -> Recorded:
        own = [(kind, table) for (whose, kind, _), table in zip(files, tables, strict=True) if whose == side]
        return Recorded(
            **{kind: table for kind, table in own if kind != "perturbed"},
            perturbed=[table for kind, table in own if kind == "perturbed"],
            refinement=_factor_and_order(refinement, f"--refinement-{side}"),
        )

    first, second = recorded("a", refinement_a), recorded("b", refinement_b)
    loaded, warnings = (
        (load_scene(scene), ()) if scene is not None else recorded_scene(first.base, second.base)
    )
    gate = {**({} if loaded is None else loaded.gate), **({} if rules is None else rules.gate)}
    stated = {
        "--tolerance": tolerance,
        "--time-tolerance": time_tolerance,
        "--share": share < 1,
        "the gate": gate,
    }
    if loaded is not None:
        tolerance = loaded.tolerance if tolerance is None else tolerance
        time_tolerance = (loaded.time_tolerance or None) if time_tolerance is None else time_tolerance
    unused, why = [], ""
    if finer_a is not None:
        unused, why = list(stated), ": the uncertainty from finer runs decides"
    elif tolerance is None:
        unused, why = ["--time-tolerance", "--share"], " without a tolerance"
    warnings = (*left_out, *warnings, *(f"{name} has no effect{why}" for name in unused if stated[name]))

    def command_with(tolerance: float | None) -> str:
        given = {
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
        words = [(name, value) for name, value in given.items() if value is not None]
        words += [(f"--{kind}-{side}", path) for side, kind, path in files if kind != "base"]
        return command_line("compare", [str(a), str(b)], {}, [str(word) for pair in words for word in pair])

    command = command_with(tolerance)
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
        warnings=warnings,
        only=None if rules is None else rules.compare,
    )
    if tolerance is None and finer_a is None:
        comparison = replace(comparison, closer_command=command_with(0.01))
    lines = (*channel_lines(comparison), *wrapped(shift_line(comparison)))
    for line in (*lines, *verdict_lines([comparison], verbose=True)):
        typer.echo(line, err=json)  # with colours
    if json:
        print_json(as_mapping(comparison))
    say(str(write_page([comparison], folder, command)), err=json)
    warn(comparison.warnings)
    return exit_code([EXIT_CODES[comparison.verdict]], allow_indeterminate=allow_indeterminate)


def _factor_and_order(text: str | None, name: str) -> tuple[float, float] | None:
    if text is None:
        return None
    try:
        factor, order = map(float, text.split(","))
    except ValueError:
        factor, order = 0.0, 0.0
    if not (1 < factor < float("inf") and 0 < order < float("inf")):
        raise typer.BadParameter(f"{name} {text!r} must be a factor above 1 and an order, as in 2,4")
    return factor, order
