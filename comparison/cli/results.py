"""What `sixbar validate` and `sixbar compare` print and write: verdicts, report, tables, files for CI.

It imports what the commands need, and is imported when one of them runs.
"""

from collections.abc import Mapping, Sequence
from glob import escape
from math import isfinite
from pathlib import Path
from typing import Any

from comparison.cli.console import columns, wrapped
from comparison.files import replacing_in, write_json, write_text
from comparison.formatting import MISSING, NO_BREAK, number, percent
from comparison.report.ci import write_job_summary, write_junit
from comparison.report.page import origin, render
from comparison.tables.table_files import write
from comparison.verdict.results import SceneComparison
from comparison.verdict.validate import Validation
from comparison.words import verdicts as words
from comparison.words.record import Case, of_comparisons
from comparison.words.verdicts import ratio_name


def verdict_lines(comparisons: Sequence[SceneComparison], *, verbose: bool = False) -> list[str]:
    """Return one line per scene and tier, below a heading; with their reasons below each if verbose."""
    tiers = [(scene.name, tier) for scene in comparisons for tier in scene.tiers]
    rows = [
        (
            name,
            tier.tier,
            tier.verdict,
            percent(tier.coverage).replace(NO_BREAK, " "),
            MISSING if tier.decisive is None else number(tier.decisive.ratio, 2),
            _note(tier),
        )
        for name, tier in tiers
    ]
    headings = ("scene", "tier", "verdict", "coverage", ratio_name(comparisons), "")
    heading, *lines = columns([headings, *rows], right=(3, 4), verdict=2)
    shown = [heading]
    for line, (_, tier) in zip(lines, tiers, strict=True):
        shown.append(line)
        for topic, text in words.reasons(tier) if verbose else ():
            shown += wrapped(text, first=f"    {topic:<12}  ")
    return shown


def _note(tier: SceneComparison) -> str:
    """Return in a few words where the trajectories diverge, or what is missing."""
    notes, result, worst = [], tier.attribution, tier.worst_channel
    if tier.error:
        return tier.error
    if tier.verdict == "differ" and result.outside_in:
        notes.append(f"{result.outside_in} from {result.outside_from:.3f} s")
    notes.append(words.mark(tier))
    if tier.verdict == "indeterminate" and worst is not None:
        notes.append(f"{worst.channel}: {words.reason(worst)}")
    return "; ".join(filter(None, notes))


def channel_lines(comparison: SceneComparison) -> list[str]:
    """Return one line per channel: verdict, largest difference, coverage, samples outside, RMS."""
    heading = ("channel", "verdict", "max", "unit", "max/scale", "coverage", "outside", "rms", "rms/scale")
    rows = [
        (
            channel.channel,
            channel.verdict,
            f"{channel.max_difference:.3g}",
            channel.unit,
            f"{channel.max_scaled:.3g}",
            f"{channel.coverage:.1%}",
            str(channel.outside) if isfinite(channel.worst_threshold) else "",
            f"{channel.rms_difference:.3g}",
            f"{channel.rms_scaled:.3g}",
        )
        for channel in comparison.channels.values()
    ]
    return columns([heading, *rows], right=(2, 4, 5, 6, 7, 8), verdict=1)


def write_page(
    comparisons: Sequence[SceneComparison],
    folder: Path,
    command: str,
    missing: Sequence[str] = (),
    title: str = "",
) -> Path:
    """Write the report of scenes into a folder and return its path; its title says how many are missing."""
    total = len(comparisons) + len(missing)
    title = title or (comparisons[0].title if total == 1 else "Cross-validation of the two models")
    if missing:
        title += f" (incomplete: {len(comparisons)} of {total} scenes)"
    path = folder / "report.html"
    write_text(render(comparisons, title=title, command=command, origin=origin()), path)
    return path


def write_validation(
    results: Sequence[Validation], folder: Path, summary: Mapping[str, Any]
) -> tuple[Path, list[str]]:
    """Write the report with its tables and summaries; return its path, and where partial results are.

    Tables of an earlier call are deleted where there is none now: they would appear to belong to this report.
    """
    comparisons = [result.comparison for result in results]
    missing, command, kept = summary["not_compared"], summary["command"], []
    with replacing_in(folder) as part:
        page = write_page(comparisons, part, command, missing)
        for result in results:
            name = result.comparison.name
            for model, run in result.runs.items():
                write(run.base, part / "tables" / f"{name}-{model}.csv")
            for which, table in result.partial.items():
                path = Path("tables", f"{name}.{which.replace(' ', '-')}.partial.csv")
                write(table, part / path)
                kept.append(f"{len(table.frame)} samples of the {which} run are in {folder / path}")
            for which, text in result.tracebacks.items():
                path = Path(f"{name}.{which.replace(' ', '-')}.traceback.txt")
                write_text(text, part / path)
                kept.append(f"the traceback of the {which} run is in {folder / path}")
        write_json(summary, part / "summary.json")
        cases = of_comparisons(comparisons)
        cases += [Case(name, "standard", "verdict", "error", "not compared: interrupted") for name in missing]
        write_junit(cases, part / "junit.xml", name="sixbar validate")
        lines = [words.headline(comparisons), words.incomplete(comparisons, missing), f"Made by: {command}"]
        write_job_summary(
            part / "summary.md",
            title="Cross-validation of the two models",
            sentences=[line for line in lines if line],
            headings=("scene", "tier", "verdict", "why"),
            rows=[
                (c.name, tier.tier, tier.verdict, words.why(tier)) for c in comparisons for tier in c.tiers
            ],
            cases=cases,
        )
        new = {path.name for path in part.rglob("*")}
    for name in (*missing, *(comparison.name for comparison in comparisons)):
        stale = [*(folder / "tables").glob(f"{escape(name)}.*.partial.*")]
        stale += folder.glob(f"{escape(name)}.*.traceback.txt")
        for end in (".csv", ".events.csv", ".pulses.csv", ".extrema.csv", ".json"):
            stale += [folder / "tables" / f"{name}-{model}{end}" for model in comparisons[0].labels]
        for path in stale:
            if path.name not in new:
                path.unlink(missing_ok=True)
    return folder / page.name, kept
