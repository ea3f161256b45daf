"""``sixbar compare``, ``validate`` and ``reliability``: comparisons of tables and of models.

``compare`` takes any two tables, or folders of them, with further runs that give their uncertainty;
``validate`` runs two models, or more in pairs, on scenes; ``reliability`` tells how well the slider of one
table or two follows the ideal mechanism.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from comparison.cli import console
from comparison.cli.console import columns, print_json, say, say_wrapped, warn, wrapped

if TYPE_CHECKING:
    from comparison.verdict.results import SceneComparison

_NOT_REPEATED = ("a", "b", "out", "json", "allow_indeterminate")  # options that affect no number
_A = Annotated[Path, typer.Argument(metavar="A", hidden=True)]
_Coarser = Annotated[Path | None, console.option("FILE", "A run at a coarser setting.")]
_Starts = Annotated[
    list[Path] | None, console.option("FILE", "A run from a moved start; repeat for several.")
]
_Repeats = Annotated[
    list[Path] | None, console.option("FILE", "A repetition that shows its error; repeat for several.")
]
_Errors = Annotated[Path | None, console.option("FILE", "TOML file of its error: channel = number.")]
_Refinement = Annotated[
    str | None,
    console.option("FACTOR,ORDER", "Factor between two settings, order of the error; default 2,2."),
]


@dataclass(frozen=True)
class Comparison:
    """Options of ``sixbar compare``; those that `comparison.verdict.channel.Criteria` has mean the same."""

    context: typer.Context
    a: _A
    b: Annotated[Path, typer.Argument(metavar="B", hidden=True)]
    scene: console.OfScene = None
    tolerance: Annotated[
        float | None, console.option("X", "Allowed difference, as a share of each channel's scale.")
    ] = None
    absolute: Annotated[
        bool, console.option(None, "The tolerance is in each channel's unit instead.", "--absolute")
    ] = False
    share: Annotated[
        float,
        console.option(
            "X", "Share of the samples that must be within; those exactly zero in both do not count."
        ),
    ] = 1.0
    time_tolerance: Annotated[
        float | None, console.option("SECONDS", "Time by which either table may be early or late; default 0.")
    ] = None
    channels: Annotated[str | None, console.option("NAME[,...]", "Compare these channels alone.")] = None
    mapping: console.MappingFile = None
    suggest_mapping: Annotated[
        bool,
        console.option(None, "Write a mapping file to edit; nothing is compared.", "--suggest-mapping"),
    ] = False
    common_time: Annotated[
        bool, console.option(None, "Compare tables of different spans where both have rows.", "--common-time")
    ] = False
    at_events: console.AtEvents = None
    finer_a: console.Finer = None
    finer_b: console.Finer = None
    coarser_a: _Coarser = None
    coarser_b: _Coarser = None
    perturbed_a: _Starts = None
    perturbed_b: _Starts = None
    repeat_a: _Repeats = None
    repeat_b: _Repeats = None
    u_a: _Errors = None
    u_b: _Errors = None
    refinement_a: _Refinement = None
    refinement_b: _Refinement = None
    period: Annotated[
        float | None,
        console.option("SECONDS", "Period of the motion; by default the scene's, else the time of a turn."),
    ] = None
    until: console.Until = None
    out: Annotated[
        Path | None,
        console.option("PATH", "Folder of the report, below reports/out by default; or the mapping's file."),
    ] = None
    json: console.AsJson = False
    allow_indeterminate: console.AllowIndeterminate = False

    def runs(self, side: str) -> list[tuple[str, Path]]:
        """Return the table of "a" or "b" and its further runs, each with its kind."""
        runs = ("finer", "coarser", "perturbed")
        finer, coarser, perturbed = (getattr(self, f"{kind}_{side}") for kind in runs)
        further = [("finer", finer), ("coarser", coarser), *(("perturbed", path) for path in perturbed or ())]
        further += [("repeat", path) for path in getattr(self, f"repeat_{side}") or ()]
        return [("base", getattr(self, side)), *((kind, path) for kind, path in further if path is not None)]

    def criteria(self) -> dict[str, Any]:
        """Return the arguments of `comparison.verdict.recorded.compare_files` beside tables and labels."""
        from comparison.scene import load_scene, parse_set
        from comparison.tables.mapping import load_mapping
        from comparison.verdict.channel import Criteria

        names = None if self.channels is None else [name.strip() for name in self.channels.split(",")]
        fields = ("tolerance", "absolute", "share", "time_tolerance", "at_events", "common_time", "period")
        values = parse_set([f"until={self.until}"] if self.until else [])
        criteria = Criteria(channels=names, **values, **{name: getattr(self, name) for name in fields})
        refinements = tuple(
            _factor_and_order(getattr(self, f"refinement_{side}"), f"--refinement-{side}") for side in "ab"
        )
        scene = None if self.scene is None else load_scene(self.scene)
        mapping = None if self.mapping is None else load_mapping(self.mapping)
        errors = tuple(None if path is None else _errors(path) for path in (self.u_a, self.u_b))
        arguments = {"scene": scene, "mapping": mapping, "criteria": criteria}
        return {**arguments, "refinements": refinements, "errors": errors}

    def command(self, **changes: object) -> str:
        """Return the command with all options that affect a number, some of them with other values."""
        from comparison.scene import command_line

        words = []
        for option in self.context.command.params:
            value = {**self.context.params, **changes}[str(option.name)]
            if option.name in _NOT_REPEATED or value is None or value == option.default:
                continue
            for each in value if isinstance(value, list | tuple) else [value]:
                words += [option.opts[0]] if each is True else [option.opts[0], str(each)]
        return command_line("compare", [str(self.a), str(self.b)], {}, words)


@console.take_options(Comparison)
def compare(options: Comparison) -> int:
    """Compare any two tables, also of other programs, or all tables of one name in two folders.

    A, B: .csv, .parquet, .mat, .xlsx, or text of another program. A finer run of each, better with coarser
    and perturbed ones, gives their numerical uncertainty, by which they are judged as by `sixbar validate`.
    Else a tolerance decides; without one: metrics and "indeterminate".
    """
    from comparison.cli.results import channel_lines, verdict_lines, write_page
    from comparison.files import check_folder
    from comparison.verdict.recorded import compare_files
    from comparison.verdict.results import exit_code
    from comparison.words.differences import lead
    from comparison.words.record import as_mapping
    from comparison.words.verdicts import headline, shift_line

    if options.suggest_mapping:
        return _suggest(options)
    a, b, command, criteria = options.a, options.b, options.command(), options.criteria()
    folder = check_folder(options.out or console.REPORTS / "compare")
    if a.is_dir() and b.is_dir():
        if len(options.runs("a")) + len(options.runs("b")) > 2 or options.u_a or options.u_b:
            raise typer.BadParameter("further runs are those of two tables, not of two folders")
        comparisons, title, lines = _by_name(a, b, criteria), f"Tables of {a} and {b}", []
    else:
        labels = (a.stem, b.stem) if a.stem != b.stem else (str(a), str(b))
        labels = labels if labels[0] != labels[1] else (f"{a} (a)", f"{b} (b)")
        comparison = compare_files(options.runs("a"), options.runs("b"), labels=labels, **criteria)
        comparison = replace(comparison, command=command)
        if all(channel.threshold is None for channel in comparison.channels.values()):
            comparison = replace(comparison, closer_command=options.command(tolerance=0.01))
        comparisons, title = [comparison], ""
        lines = [*channel_lines(comparison), *wrapped(shift_line(comparison))]
    say_wrapped(*lead(comparisons), err=options.json)
    for line in (*lines, *verdict_lines(comparisons, verbose=True)):
        typer.echo(line, err=options.json)  # with colours
    if any(comparison.has_u for comparison in comparisons):
        say_wrapped(headline(comparisons), err=options.json)
    if options.json:
        print_json([*map(as_mapping, comparisons)] if title else as_mapping(comparisons[0]))
    say(str(write_page(comparisons, folder, command, title=title)), err=options.json)
    for comparison in comparisons:
        warn([f"{comparison.name}: {line}" if title else line for line in comparison.warnings])
    codes = [comparison.exit_code for comparison in comparisons]
    return exit_code(codes, allow_indeterminate=options.allow_indeterminate)


def _suggest(options: Comparison) -> int:
    """Write a mapping of the columns of two tables, and print its assignments."""
    from comparison.files import FolderError, check_file, write_text
    from comparison.scene import command_line
    from comparison.tables.mapping import Dialects, load_mapping
    from comparison.tables.suggest import mapping_text, suggest

    a, b = options.a, options.b
    path = check_file(options.out or Path(f"{b.stem}.mapping.toml"))
    if path.exists():
        raise FolderError(f"{path}: exists, and is not overwritten; --out names another file")
    dialects = load_mapping(options.mapping).dialect if options.mapping else Dialects()
    guesses, rest = suggest(a, b, dialects)
    command = command_line("compare", [str(a), str(b)], {}, ["--mapping", str(path), "--tolerance", "0.01"])
    text = mapping_text(guesses, rest, dialects, command)
    write_text(text, path)
    if options.json:
        print_json([rule for guess in guesses for rule in guess.rules()])
    say(*text.splitlines(), str(path), err=options.json)
    return 0


def _by_name(a: Path, b: Path, criteria: dict[str, Any]) -> list[SceneComparison]:
    """Compare the tables of equal names in two folders; one without a partner cannot be compared."""
    from comparison.tables.table import TableError
    from comparison.tables.table_files import tables_in
    from comparison.verdict.recorded import compare_files
    from comparison.verdict.results import no_comparison_of_tables

    (first, *others_a), (second, *others_b) = tables_in(a), tables_in(b)
    for folder, others in ((a, others_a[0]), (b, others_b[0])):
        if others:
            warn([f"{folder}: not compared, since they are no tables: {', '.join(others)}"])
    if not first:
        raise TableError(f"{a}: holds no table")
    labels = (a.name, b.name) if a.name != b.name else (str(a), str(b))
    comparisons = []
    for name, path in first.items():
        if name not in second:
            comparisons.append(no_comparison_of_tables(name, f"{b} has no table of this name", labels))
            continue
        try:
            comparison = compare_files([("base", path)], [("base", second[name])], labels=labels, **criteria)
        except TableError as error:
            comparison = no_comparison_of_tables(name, str(error), labels)
        comparisons.append(replace(comparison, name=name))
    extras = [name for name in second if name not in first]
    return comparisons + [
        no_comparison_of_tables(name, f"{a} has no table of this name", labels) for name in extras
    ]


def _errors(path: Path) -> dict[str, float]:
    """Read the stated error of each channel, in its unit."""
    import tomllib

    from comparison.files import contents, reading
    from comparison.tables.table import TableError

    with reading(path, TableError, "TOML"):
        errors: dict[str, float] = tomllib.loads(contents(path))
        for name, error in errors.items():
            if not isinstance(error, int | float) or not 0 < error < float("inf"):
                raise TableError(f"{name} = {error!r} must be a number > 0")
    return errors


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


@dataclass(frozen=True)
class Validation:
    """Options of ``sixbar validate``."""

    scenes: console.SceneNames = None
    out: console.OutFolder = None
    jobs: console.Jobs = None
    accuracy: console.Accuracy = None
    models: console.Models = "reference,exudyn"
    overrides: console.Overrides = None
    until: console.Until = None
    allow_indeterminate: console.AllowIndeterminate = False
    quick: console.Quick = False
    since: console.Since = None
    verbose: console.Verbose = False
    quiet: console.Quiet = False
    json: console.AsJson = False

    @property
    def changes(self) -> dict[str, object]:
        """The dotted keys to change, and their values."""
        from comparison.scene import parse_set

        demand = [f"compare.until={self.until}"] if self.until else []
        return parse_set([*(self.overrides or []), *demand])

    @property
    def tiers(self) -> Sequence[str]:
        """The tiers to judge at."""
        from comparison.accuracy.levels import TIERS

        return TIERS[:1] if self.quick else TIERS

    def command(self, models: Sequence[str]) -> str:
        """Return the command line that repeats it for some models."""
        from comparison.scene import command_line
        from comparison.verdict.validate import options

        choices = options(models, self.accuracy, self.tiers)
        return command_line("validate", self.scenes or [], self.changes, choices)


@console.take_options(Validation)
def validate(options: Validation) -> int:
    """Run scenes by two models, compare them, and write a report.

    SCENE: shipped names or TOML files; all shipped scenes by default. Each model runs with refined and
    perturbed runs, which give its uncertainty. With more than two models each pair is compared, and the
    report identifies the outlier among them. Stopped by Ctrl-C, it writes the report of the scenes finished
    by then, marked as incomplete.
    """
    from comparison.cli.results import validate_pair, validate_pairs
    from comparison.execution.pool import kept_workers
    from comparison.models import distinct_models
    from comparison.scene import name_with

    with kept_workers():
        first, second, *others = several = distinct_models(options.models)
        if others:
            folder = options.out or console.REPORTS / name_with("pairwise", options.changes)
            code, summary = validate_pairs(options, several, folder)
        else:
            code, summary = validate_pair(options, (first, second), options.out)
    if options.json and summary:
        print_json(summary)
    return code


@dataclass(frozen=True)
class Motion:
    """Options of ``sixbar reliability``; those that ``sixbar compare`` has mean the same."""

    a: _A
    b: Annotated[Path | None, typer.Argument(metavar="B", hidden=True)] = None
    _: KW_ONLY
    ideal: Annotated[Path, console.option("FILE", "Table of the mechanism without clearance.")]
    limits: Annotated[
        list[str] | None,
        console.option(
            "QUANTITY=LOWER,UPPER",
            "Limits of the error of displacement (m), velocity (m/s) or acceleration (m/s^2); by default the "
            "scene's.",
        ),
    ] = None
    scene: console.OfScene = None
    period: Annotated[
        float | None, console.option("SECONDS", "Period of the crank; by default the scene's.")
    ] = None
    mapping: console.MappingFile = None
    at_events: console.AtEvents = None
    finer_a: console.Finer = None
    finer_b: console.Finer = None
    verbose: Annotated[
        bool, console.option(None, "Also print the reliability by crank angle.", "--verbose", "-v")
    ] = False
    json: console.AsJson = False
    allow_indeterminate: console.AllowIndeterminate = False


@console.take_options(Motion)
def reliability(options: Motion) -> int:
    """Compute how reliably the slider follows the ideal mechanism.

    A, B: tables of any program, as for `sixbar compare`. Reliability as in Section 3 of the paper
    (stress-strength interference), of slider_y, slider_vy and slider_ay, with 95 % intervals. The difference
    of A and B is judged if both have a finer run. `sixbar run ideal` writes a table of the ideal mechanism.
    """
    from comparison.reliability.tables import reliability as reliability_of
    from comparison.scene import load_scene
    from comparison.verdict.results import EXIT_CODES, exit_code
    from comparison.words.record import reliability_mapping
    from comparison.words.reliability import difference_rows, table_notes, table_rows

    fields = ("ideal", "period", "mapping", "at_events", "finer_a", "finer_b")
    result = reliability_of(
        options.a,
        options.b,
        limits=dict(map(_limits, options.limits or ())),
        scene=None if options.scene is None else load_scene(options.scene),
        **{name: getattr(options, name) for name in fields},
    )
    for label, name in zip("ab", result.names, strict=False):
        say(f"{label}: {name}", err=options.json)
    if options.verbose:
        say(*columns(table_rows(result, every=True), right=range(1, 7)), "", err=options.json)
    say(*columns(table_rows(result, every=False), right=range(1, 7)), err=options.json)
    if result.comparison:
        say(*columns(difference_rows(result.comparison), right=(1, 2)), err=options.json)
    say_wrapped(*table_notes(result), err=options.json)
    if options.json:
        print_json(reliability_mapping(result))
    warn(result.warnings)
    if result.comparison is None:
        return 0
    verdict = {"undecided": "indeterminate"}.get(result.comparison.verdict, result.comparison.verdict)
    return exit_code([EXIT_CODES[verdict]], allow_indeterminate=options.allow_indeterminate)


def _limits(text: str) -> tuple[str, tuple[float, float]]:
    quantity, _, numbers = text.partition("=")
    try:
        lower, upper = map(float, numbers.split(","))
    except ValueError:
        raise typer.BadParameter(
            f"--limits {text!r} must be a quantity and two numbers, as in --limits velocity=0,0.02"
        ) from None
    return quantity.strip(), (lower, upper)
