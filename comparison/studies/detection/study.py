"""The verdicts themselves under test: false alarms, missed faults, the smallest detectable change."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice

from comparison.execution.run import Progress
from comparison.studies.detection import alarms, cross_model, limits, rounding
from comparison.studies.detection.copies import installed
from comparison.studies.detection.cross_model import Draw
from comparison.studies.detection.faults import Fault, catalogue, controls, trials
from comparison.studies.detection.page import draw, page
from comparison.studies.detection.results import Results, record
from comparison.studies.detection.tasks import Comparison, Found, find_all
from comparison.studies.shared.study import Study, part

# Of the whole time: what is measured of the rounding, faults with self comparisons and limits, both models.
_PARTS = (0.01, 0.4, 1.0)


@dataclass(frozen=True)
class Config:
    """What is compared."""

    both: tuple[cross_model.Kind, ...]
    """Kinds of comparisons of both models."""
    own: tuple[alarms.Kind, ...]
    """Kinds of comparisons of a model with itself."""
    roundings: tuple[rounding.Rounding, ...]
    """Variants of rounding under which both models run; the first is what the others are held against."""
    faults: tuple[Fault, ...]
    parameters: tuple[tuple[str, str, str], ...]
    """Whose smallest detectable change is sought, see `limits.PARAMETERS`."""
    halvings: int
    """Of the decades in that search."""


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Make all comparisons; those that were made before are not repeated."""
    own, faults, healthy = [alarms.pairs(kind) for kind in config.own], trials(config.faults), controls()
    searches = limits.searches(config.parameters, config.halvings)
    tasks: list[Comparison] = [
        *(pair for drawn in own for pair in drawn),
        *healthy,
        *(trial.pair for trial in faults),
        *searches,
    ]
    changes = [fault for fault in config.faults if fault.kind == "code"]
    copies = {engine for variant in config.roundings for engine in variant.engines.values()}
    with installed([*changes, *(copy for copy in rounding.REARRANGED if copy.engine in copies)]):
        measurements = rounding.measurements(config.roundings)
        measured = find_all(measurements, n_jobs, part(on_progress, 0.0, _PARTS[0]))
        bits = rounding.hashes(config.roundings, measured)
        found = iter(find_all(tasks, n_jobs, part(on_progress, *_PARTS[:2])))
        both = _both_models(config.both, bits, n_jobs, on_progress)
    return Results(
        both=both,
        own=[(kind, _next(found, drawn)) for kind, drawn in zip(config.own, own, strict=True)],
        bits=bits,
        healthy=_next(found, healthy),
        faults=list(zip(faults, _next(found, faults), strict=True)),
        smallest={name: _next(found, limits.PLACES) for name, _, _ in config.parameters},
    )


def _both_models(
    kinds: Sequence[cross_model.Kind],
    bits: Mapping[rounding.Rounding, tuple[str, ...]],
    n_jobs: int,
    on_progress: Progress | None,
) -> list[tuple[cross_model.Kind, dict[rounding.Rounding, list[Found]]]]:
    """Draw each kind by its rule of stopping."""
    start, end = _PARTS[1:]
    each = (end - start) / len(kinds)
    both = []
    for number, kind in enumerate(kinds):
        # The first round is nearly all of it: later ones replace what was indeterminate.
        reports = iter([part(on_progress, start + number * each, start + (number + 1) * each)])

        def find(draws: Sequence[Draw], reports: Iterator[Progress | None] = reports) -> list[Found]:
            return find_all([each.pair for each in draws], n_jobs, next(reports, None))

        both.append((kind, cross_model.sample(kind, rounding.effective(bits, kind.tier), find)))
    return both


def _next(found: Iterator[Found], of: Sequence[object]) -> list[Found]:
    return list(islice(found, len(of)))


def _few_faults() -> tuple[Fault, ...]:
    """Return a wrong number and some wrong tables: none that needs a copy of a model."""
    numbers, tables = ([fault for fault in catalogue() if fault.kind == kind] for kind in ("number", "table"))
    return numbers[0], *tables[-3:]


STUDY = Study(
    "detection",
    small=Config(
        both=tuple(replace(kind, wanted=2) for kind in cross_model.KINDS),
        own=tuple(replace(kind, draws=2) for kind in alarms.KINDS),
        roundings=rounding.ROUNDINGS[:2],
        faults=_few_faults(),
        parameters=limits.PARAMETERS[:1],
        halvings=1,
    ),
    full=Config(
        both=cross_model.KINDS,
        own=alarms.KINDS,
        roundings=rounding.ROUNDINGS,
        faults=tuple(catalogue()),
        parameters=limits.PARAMETERS,
        halvings=limits.HALVINGS,
    ),
    measure=measure,
    page=page,
    draw=draw,
    data=record,
)
