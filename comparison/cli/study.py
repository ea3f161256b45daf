"""``sixbar study``: one command per study, and the sweep with its own options; and ``make reports``."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from comparison.cli import console
from comparison.cli.console import columns, complain, progress, say, warn
from comparison.formatting import table
from comparison.studies import NAMES, STUDIES, SUCCESSORS, write_study
from comparison.studies.paper import PARTS

_MOST_ROWS = 20  # most rows of a sweep on the terminal; a 21st replaces the line that counts the rest
_OutStudy = Annotated[
    Path | None, console.option("FOLDER", "Folder of the study, below reports/out by default.")
]

studies = typer.Typer(help="Run a multi-run study. Cached runs are used.")


@studies.callback(invoke_without_command=True)
def _root(context: typer.Context) -> None:
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


_Small = Annotated[bool, console.option(None, "Few and short runs, for a trial.", "--small")]


def _write(
    name: str, out: Path | None, jobs: int | None, small: bool, quiet: bool, parts: Sequence[str] = ()
) -> int:
    from comparison.execution.pool import cpus
    from comparison.files import check_folder

    folder = check_folder(out or console.REPORTS / name)
    with progress(name, quiet=quiet) as report:
        pages = write_study(name, folder, jobs or cpus(), report, small=small, parts=parts)
    say(*map(str, pages))
    return 0


def _command(name: str) -> Callable[..., int]:
    def command(
        out: _OutStudy = None,
        jobs: console.Jobs = None,
        small: _Small = False,
        quiet: console.NoProgress = False,
    ) -> int:
        return _write(name, out, jobs, small, quiet)

    return command


def _paper(
    part: Annotated[
        list[str] | None,
        console.option("PART", f"Part to write: {', '.join(PARTS)}; repeat for more. By default all."),
    ] = None,
    out: _OutStudy = None,
    jobs: console.Jobs = None,
    small: _Small = False,
    quiet: console.NoProgress = False,
) -> int:
    if unknown := [name for name in part or () if name not in PARTS]:
        raise typer.BadParameter(f"--part {unknown[0]!r} is none of {', '.join(PARTS)}")
    return _write("paper", out, jobs, small, quiet, list(dict.fromkeys(part or ())))


for _name, _about in STUDIES.items():
    studies.command(_name, help=f"{_about} Writes a README.md with figures.", short_help=_about)(
        _paper if _name == "paper" else _command(_name)
    )


def _redirect(name: str, words: str) -> Callable[[], int]:
    return lambda: complain(f"study {name} is a part of another now: sixbar study {words}", 2)


for _name, _words in SUCCESSORS.items():
    # With whatever options it once had.
    studies.command(
        _name, hidden=True, context_settings={"ignore_unknown_options": True, "allow_extra_args": True}
    )(_redirect(_name, _words))


@dataclass(frozen=True)
class Sweep:
    """Options of ``sixbar study sweep``."""

    scene: console.SceneName
    grid: Annotated[
        list[str] | None,
        console.option("KEY=A,B,C", "Values of a key; repeat for more keys: all combinations."),
    ] = None
    listed: Annotated[
        Path | None, console.option("FILE", "CSV: keys in the first line, values in the others.", "--list")
    ] = None
    latin: Annotated[
        list[str] | None,
        console.option("KEY=LOW:HIGH", "Range of a key for a Latin hypercube; repeat for more."),
    ] = None
    points: Annotated[int, console.option("N", "Points of the Latin hypercube.")] = 100
    seed: Annotated[int, console.option("N", "Seed of the Latin hypercube.", min=0)] = 0
    model: Annotated[
        str, console.option("NAME,NAME", "Models: reference, exudyn, those of other packages.")
    ] = "reference"
    output: Annotated[
        list[str] | None,
        console.option(
            "QUANTITY",
            "min:CHANNEL, max:, rms:, end:, peak_error:slider_y, contacts, impulse, largest:peak_force, "
            "steps ...; repeat for more. By default peak errors, contacts, impulse and largest force.",
        ),
    ] = None
    overrides: console.Overrides = None
    out: _OutStudy = None
    jobs: console.Jobs = None
    scheduler: Annotated[
        str | None, console.option("ADDRESS", "Address of a Dask scheduler; by default local processes.")
    ] = None
    quiet: console.NoProgress = False


@studies.command()
@console.take_options(Sweep)
def sweep(options: Sweep) -> int:
    """Run a scene over values of its keys: one row per run.

    SCENE: a shipped scene or the path of a TOML file. The folder, by default reports/out/sweep-SCENE, holds
    sweep.csv and finished runs: the same command resumes an interrupted sweep. Failed runs are rows with the
    reason; where no run succeeds the exit code is 2.
    """
    import pandas as pd

    from comparison.execution.pool import cpus
    from comparison.execution.tasks import on_processes
    from comparison.files import check_folder
    from comparison.scene import load_scene, parse_set
    from comparison.studies.sweep import DEFAULTS, SweepError, check_set, on_cluster, sweep_points
    from comparison.studies.sweep import sweep as run_sweep
    from comparison.tables.channels import expected

    models = [name.strip() for name in options.model.split(",")]
    try:
        points = sweep_points(options.grid, options.listed, options.latin, options.points, options.seed)
        values = parse_set(options.overrides or [])
        check_set(points, values)
        base = load_scene(options.scene, values)
        folder = check_folder(options.out or console.REPORTS / f"sweep-{base.name}")
        jobs, scheduler = options.jobs or cpus(), options.scheduler
        pool = on_processes(jobs) if scheduler is None else on_cluster(scheduler)
        with progress(f"sweep of {base.name}", quiet=options.quiet) as report:
            default = [f"max:{name}" for name in expected(base.data)] if base.is_linkage else DEFAULTS
            path, failures = run_sweep(base, points, models, options.output or default, folder, pool, report)
    except SweepError as error:
        raise typer.BadParameter(str(error)) from error
    if failures:
        warn([f"{failures} of {len(points) * len(models)} runs did not succeed: see the column status"])
    frame = pd.read_csv(path, keep_default_na=False, na_values=[""])
    count = len(frame) if len(frame) <= _MOST_ROWS + 1 else _MOST_ROWS
    cells = {
        name: [f"{value:.5g}" if isinstance(value, float) else str(value) for value in column[:count]]
        for name, column in frame.astype(object).where(frame.notna(), "").items()
    }
    say(*columns([list(map(str, cells)), *zip(*cells.values(), strict=True)]))
    if len(frame) > count:
        say(f"... and {len(frame) - count} more rows")
    say(str(path))
    return 2 if failures == len(frame) else 0


# ---- make reports, in the folder of the README: all studies, their index, and a part of the README

BEGIN, END = "<!-- verdicts: generated, do not edit -->", "<!-- end of verdicts -->"
REPORTS = Path("reports")
ABOUT_THE_VERDICT = "trust"
"""Study that tests the verdict itself; its finding follows the table in the README."""


def index(pages: dict[str, str]) -> str:
    """Return the index of the studies' pages (by path), with the finding and first picture of each."""
    parts = ["# What the studies say about the current code", "Generated by `make reports`."]
    for path, text in pages.items():
        parts.append(f"## [{text.partition(chr(10))[0].removeprefix('# ')}]({path})")
        parts += filter(None, [finding(text)])
        if picture := re.search(r"^!\[(.*?)\]\(([\w./-]+\.svg)\)", text, re.MULTILINE):
            parts.append(f"![{picture[1]}]({(Path(path).parent / picture[2]).as_posix()})")
    return "\n\n".join(parts) + "\n"


def finding(readme: str) -> str:
    """Return the finding of a study: its README's first paragraph in bold, up to where that ends."""
    bold = re.search(r"^\*\*(.+?)\*\*", readme, re.DOTALL | re.MULTILINE)
    return " ".join(bold[1].split()) if bold else ""


def generated(pages: dict[str, str]) -> str:
    """Return the generated part of the README, from the pages of the studies by their paths."""
    from comparison.accuracy.levels import TIERS

    page = f"{ABOUT_THE_VERDICT}/README.md"
    rates = f"The verdict itself, tested: {finding(pages[page])} [More](reports/{page})."
    for heading, name in (("Its uncertainties, tested", "truth"), ("On systems of others", "foreign")):
        path = f"{name}/README.md"
        rates += f"\n\n{heading}: {finding(pages[path])} [More](reports/{path})."
    verdicts = pages["verdicts/README.md"].splitlines()
    rows = [line.split(" | ") for line in verdicts if line.startswith("| ")]
    places = [rows[0].index(f"{tier} tier") for tier in TIERS]
    cells = [(row[0].removeprefix("| "), *(row[column] for column in places)) for row in rows]
    origin = [line for line in verdicts if line.startswith("Made on ")]
    return "\n\n".join([table(cells[0], cells[1:]), *origin, rates])


def with_generated(readme: str, text: str) -> str:
    """Return a README with the text between its markers replaced; `ValueError` where these are missing."""
    before, begin, rest = readme.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"README.md: the markers {BEGIN!r} and {END!r} are missing")
    return f"{before}{BEGIN}\n\n{text}\n\n{END}{after}"


def main(*, small: bool = False) -> None:
    """Write all studies (stored runs are used), then the index and the generated part of the README.

    The page of a study whose engine is not installed stays as it is.
    """
    from comparison.execution.pool import cpus
    from comparison.files import write_text
    from comparison.models import EngineError

    pages: dict[str, str] = {}
    for name in NAMES:
        try:
            with progress(name) as report:
                paths = write_study(name, REPORTS / name, cpus(), report, small=small)
        except EngineError as error:
            paths = sorted((REPORTS / name).glob("*.md"))
            if not paths:
                raise
            warn([f"study {name}: {error}; its page stays as it is"])
        pages |= {page.relative_to(REPORTS).as_posix(): page.read_text("utf-8") for page in paths}
    readme = Path("README.md")
    write_text(index(pages), REPORTS / "README.md")
    write_text(with_generated(readme.read_text("utf-8"), generated(pages)), readme)
