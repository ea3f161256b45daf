"""What `sixbar validate` and `sixbar compare` write: report, tables, summaries, files for CI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from glob import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from comparison.verdict.results import SceneComparison
    from comparison.verdict.validate import Validation


def validation_summary(
    comparisons: Sequence[SceneComparison], command: str, code: int, missing: Sequence[str]
) -> dict[str, Any]:
    """Return all numbers of a validation, which ``summary.json`` holds and ``--json`` prints."""
    from comparison.files import plain
    from comparison.words.record import as_mapping

    numbers: dict[str, Any] = plain(
        {
            "command": command,
            "exit_code": code,
            "not_compared": missing,
            "scenes": [as_mapping(comparison) for comparison in comparisons],
        }
    )
    return numbers


def write_validation(
    results: Sequence[Validation], folder: Path, summary: Mapping[str, Any]
) -> tuple[Path, list[str]]:
    """Write the report with its tables and summaries; return its path, and where partial results are.

    Tables of an earlier call are deleted where there is none now: they would appear to belong to this report.
    """
    from comparison.files import replacing_in, write_json, write_text
    from comparison.tables.table_files import write

    comparisons = [result.comparison for result in results]
    command, missing = summary["command"], summary["not_compared"]
    kept = []
    with replacing_in(folder) as part:
        page = write_page(comparisons, part, command, missing)
        for result in results:
            for model, run in result.runs.items():
                write(run.base, part / "tables" / f"{result.comparison.name}-{model}.csv")
            for which, table in result.partial.items():
                name = f"{result.comparison.name}.{which.replace(' ', '-')}.partial.csv"
                write(table, part / "tables" / name)
                kept.append(
                    f"{len(table.frame)} samples of the {which} run are in {folder / 'tables' / name}"
                )
            for which, text in result.tracebacks.items():
                name = f"{result.comparison.name}.{which.replace(' ', '-')}.traceback.txt"
                write_text(text, part / name)
                kept.append(f"the traceback of the {which} run is in {folder / name}")
        write_json(summary, part / "summary.json")
        _write_for_ci(comparisons, part, command, missing)
        new = {path.name for path in part.rglob("*")}
    for name in (*missing, *(comparison.name for comparison in comparisons)):
        stale = [*(folder / "tables").glob(f"{escape(name)}.*.partial.*")]
        stale += folder.glob(f"{escape(name)}.*.traceback.txt")
        for model in comparisons[0].labels:
            ends = (".csv", ".events.csv", ".pulses.csv", ".extrema.csv", ".json")
            stale += [folder / "tables" / f"{name}-{model}{end}" for end in ends]
        for path in stale:
            if path.name not in new:
                path.unlink(missing_ok=True)
    return folder / page.name, kept


def write_page(
    comparisons: Sequence[SceneComparison], folder: Path, command: str, missing: Sequence[str] = ()
) -> Path:
    """Write the report of one or more scenes into a folder and return its path.

    Its title says so where scenes are missing.
    """
    from comparison.report import write_report
    from comparison.report.templates import origin

    total = len(comparisons) + len(missing)
    title = comparisons[0].title if total == 1 else "Cross-validation of the two models"
    if missing:
        title += f" (incomplete: {len(comparisons)} of {total} scenes)"
    return write_report(comparisons, folder, title=title, command=command, origin=origin())


def _write_for_ci(
    comparisons: Sequence[SceneComparison], folder: Path, command: str, missing: Sequence[str]
) -> None:
    """Write the files for continuous integration: JUnit XML and a Markdown summary."""
    from comparison.report.ci import write_job_summary, write_junit
    from comparison.words.cases import Case, of_comparisons
    from comparison.words.verdicts import headline, incomplete, why

    cases = [
        *of_comparisons(comparisons),
        *(Case(name, "standard", "verdict", "error", "not compared: interrupted") for name in missing),
    ]
    write_junit(cases, folder / "junit.xml", name="sixbar validate")
    lines = [headline(comparisons), incomplete(comparisons, missing), f"Made by: {command}"]
    write_job_summary(
        folder / "summary.md",
        title="Cross-validation of the two models",
        sentences=[line for line in lines if line],
        headings=("scene", "tier", "verdict", "why"),
        rows=[(c.name, tier.tier, tier.verdict, why(tier)) for c in comparisons for tier in c.tiers],
        cases=cases,
    )
