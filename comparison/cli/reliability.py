"""``sixbar reliability``: how reliably the slider of one or two tables follows the ideal mechanism."""

from pathlib import Path
from typing import Annotated

import typer

from comparison.cli import options
from comparison.cli.console import columns, print_json, say, say_wrapped, warn


def reliability(
    a: Annotated[Path, typer.Argument(hidden=True)],
    b: Annotated[Path | None, typer.Argument(hidden=True)] = None,
    *,
    ideal: Annotated[Path, options.option("FILE", "Table of the mechanism without clearance.")],
    limits: Annotated[
        list[str] | None,
        options.option(
            "QUANTITY=LOWER,UPPER",
            "Limits of the error of displacement (m), velocity (m/s) or acceleration (m/s^2); by default the "
            "scene's.",
        ),
    ] = None,
    scene: options.OfScene = None,
    period: Annotated[
        float | None, options.option("SECONDS", "Of the crank cycle; by default the scene's.")
    ] = None,
    mapping: options.MappingFile = None,
    at_events: options.AtEvents = None,
    finer_a: options.Finer = None,
    finer_b: options.Finer = None,
    verbose: Annotated[
        bool, options.option(None, "Also print the reliability by crank angle.", "--verbose", "-v")
    ] = False,
    json: options.AsJson = False,
    allow_indeterminate: options.AllowIndeterminate = False,
) -> int:
    """Compute how reliably the slider follows the ideal mechanism.

    A, B: tables of any program, as of `sixbar compare`. Reliability as in Section 3 of the paper
    (stress-strength interference), of slider_y, slider_vy and slider_ay, with 95 % intervals. The difference
    of A and B is judged if both have a finer run. `sixbar run ideal` writes a table of the ideal mechanism.
    """
    from comparison.reliability.tables import reliability as reliability_of
    from comparison.scene import load_scene
    from comparison.verdict.results import EXIT_CODES, exit_code
    from comparison.words.record import reliability_mapping
    from comparison.words.reliability import difference_rows, table_notes, table_rows

    options.check_positive("--period", period)
    result = reliability_of(
        a,
        b,
        ideal=ideal,
        limits=dict(map(_limits, limits or ())),
        scene=None if scene is None else load_scene(scene),
        period=period,
        mapping=mapping,
        at_events=at_events,
        finer_a=finer_a,
        finer_b=finer_b,
    )
    for label, name in zip("ab", result.names, strict=False):
        say(f"{label}: {name}", err=json)
    if verbose:
        say(*columns(table_rows(result, every=True), right=range(1, 7)), "", err=json)
    say(*columns(table_rows(result, every=False), right=range(1, 7)), err=json)
    if result.comparison:
        say(*columns(difference_rows(result.comparison), right=(1, 2)), err=json)
    say_wrapped(*table_notes(result), err=json)
    if json:
        print_json(reliability_mapping(result))
    warn(result.warnings)
    if result.comparison is None:
        return 0
    verdict = {"undecided": "indeterminate"}.get(result.comparison.verdict, result.comparison.verdict)
    return exit_code([EXIT_CODES[verdict]], allow_indeterminate=allow_indeterminate)


def _limits(text: str) -> tuple[str, tuple[float, float]]:
    quantity, _, numbers = text.partition("=")
    try:
        lower, upper = map(float, numbers.split(","))
    except ValueError:
        raise typer.BadParameter(
            f"--limits {text!r} must be a quantity and two numbers, as in --limits velocity=0,0.02"
        ) from None
    return quantity.strip(), (lower, upper)
