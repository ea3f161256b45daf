"""The verdicts themselves under test: false alarms, missed faults, the smallest detectable change."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path

from comparison.execution.run import Progress
from comparison.files import replacing, write_json
from comparison.studies.detection import alarms, cross_model, limits, rounding
from comparison.studies.detection.copies import installed
from comparison.studies.detection.cross_model import Draw
from comparison.studies.detection.faults import catalogue, controls, trials
from comparison.studies.detection.figures import draw
from comparison.studies.detection.finding import find_all
from comparison.studies.detection.page import text
from comparison.studies.detection.results import Results, record
from comparison.studies.detection.tasks import Comparison, Found
from comparison.studies.shared.progress import part

# Of the whole time: what is measured of the rounding, faults with self comparisons and limits, both models.
_PARTS = (0.01, 0.4, 1.0)


def write(folder: Path, n_jobs: int, on_progress: Progress | None) -> None:
    """Measure everything, and write README.md, detection.json and the figure."""
    results = measured(n_jobs, on_progress)
    draw(
        [name for name, _, _ in limits.PARAMETERS],
        [f"{model}, {tier}" for model, tier in limits.PLACES],
        results.smallest,
        folder / "smallest.svg",
    )
    write_json(record(results), folder / "detection.json")
    with replacing(folder / "README.md") as unfinished:
        unfinished.write_text(text(results), "utf-8")


def measured(n_jobs: int, on_progress: Progress | None) -> Results:
    """Make all comparisons; those that were made before are not repeated."""
    own, faults, healthy = [alarms.pairs(kind) for kind in alarms.KINDS], trials(catalogue()), controls()
    searches = limits.searches()
    tasks: list[Comparison] = [
        *(pair for drawn in own for pair in drawn),
        *healthy,
        *(trial.pair for trial in faults),
        *searches,
    ]
    changes = [fault for fault in catalogue() if fault.kind == "code"]
    with installed([*changes, *rounding.REARRANGED]):
        bits = rounding.hashes(find_all(rounding.measurements(), n_jobs, part(on_progress, 0.0, _PARTS[0])))
        found = iter(find_all(tasks, n_jobs, part(on_progress, *_PARTS[:2])))
        both = _both_models(bits, n_jobs, on_progress)
    return Results(
        both=both,
        own=[(kind, _next(found, drawn)) for kind, drawn in zip(alarms.KINDS, own, strict=True)],
        bits=bits,
        healthy=_next(found, healthy),
        faults=list(zip(faults, _next(found, faults), strict=True)),
        smallest=_by_place(_next(found, searches)),
    )


def _both_models(
    bits: Sequence[tuple[str, ...]], n_jobs: int, on_progress: Progress | None
) -> list[tuple[cross_model.Kind, dict[rounding.Rounding, list[Found]]]]:
    """Draw each kind by its rule of stopping."""
    start, end = _PARTS[1:]
    each = (end - start) / len(cross_model.KINDS)
    both = []
    for number, kind in enumerate(cross_model.KINDS):
        # The first round is nearly all of it: later ones replace what was indeterminate.
        reports = iter([part(on_progress, start + number * each, start + (number + 1) * each)])

        def find(draws: Sequence[Draw], reports: Iterator[Progress | None] = reports) -> list[Found]:
            return find_all([each.pair for each in draws], n_jobs, next(reports, None))

        both.append((kind, cross_model.sample(kind, rounding.effective(bits, kind.tier), find)))
    return both


def _next(found: Iterator[Found], of: Sequence[object]) -> list[Found]:
    return list(islice(found, len(of)))


def _by_place(found: Sequence[Found]) -> list[list[float | None]]:
    """Return the smallest detected changes, one row a parameter, one column a place."""
    columns = len(limits.PLACES)
    values = [result.get("found") for result in found]
    return [values[at : at + columns] for at in range(0, len(values), columns)]
