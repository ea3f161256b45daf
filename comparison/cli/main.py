"""Command line ``sixbar``; each command imports what it needs."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from comparison.cli.compare import compare, reliability, validate
from comparison.cli.console import INTERRUPTED, complain, describe_error, option, say, session
from comparison.cli.gate import gate
from comparison.cli.judge import judge
from comparison.cli.listing import channels, keys, new, plan, scenes
from comparison.cli.run import animate, plot, run, settings
from comparison.cli.study import studies

# The class raised by this typer: some of its releases vendor click.
_UsageError: Any = typer.BadParameter.__base__

app = typer.Typer(
    name="sixbar",
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Cross-validation of two models of a press, or of any planar linkage, with clearance in its joints.",
    epilog="Exit codes: 0 agree; 1 differ, or a regression; 2 cannot compare or bad input; 3 indeterminate, "
    "or an accuracy that is not reachable; "
    "70 a run crashed, or internal error; 130 interrupted. For several scenes the worst one.",
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit code."""
    try:
        with session(program=arguments is None):
            return _main(sys.argv[1:] if arguments is None else arguments)
    except KeyboardInterrupt:
        return complain("interrupted", INTERRUPTED)


def _main(arguments: Sequence[str]) -> int:
    if bad := [text for text in arguments if any("\ud800" <= character <= "\udfff" for character in text)]:
        return complain(f"{bad[0]}: is not UTF-8; files and folders must have names that are", 2)
    try:
        Path.cwd()
    except OSError:
        return complain("the working directory does not exist any more, or cannot be read", 2)
    try:
        code = int(typer.main.get_command(app)(arguments, prog_name="sixbar", standalone_mode=False) or 0)
    except _UsageError as error:
        command = getattr(error.ctx, "command_path", "sixbar")
        return complain(f"{error.format_message()} (see {command} --help)", 2)
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED
    except SystemExit as end:
        # Typer signals a closed output pipe (head, less) by exit code 1, which here means "differ"; the
        # shell's completion ends so too.
        return 141 if end.code == 1 else int(end.code or 0)
    except Exception as error:
        return complain(*describe_error(error))
    if code != INTERRUPTED:  # some releases of typer convert Ctrl-C to this code themselves
        return code
    caching = {*arguments[:1]} & {"validate", "judge", "gate", "study"}
    note = "; finished runs are cached" if caching else ""
    return complain(f"interrupted{note}", INTERRUPTED)


def _print_version(value: bool) -> None:
    if value:
        from importlib.metadata import version

        say(f"sixbar-crossval {version('sixbar-crossval')}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _root(
    context: typer.Context,
    _version: Annotated[
        bool,
        option(
            None, "Print the version and exit.", "--version", "-V", is_eager=True, callback=_print_version
        ),
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        say(context.get_help())


_COMMANDS = (
    scenes, channels, keys, new, plan, run, settings, validate, compare, judge, reliability, plot, animate,
    gate,
)  # fmt: skip
for _command in _COMMANDS:
    app.command()(_command)
app.add_typer(studies, name="study")
