"""What the campaign runs and writes."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from comparison.accuracy.levels import thresholds
from comparison.execution.run import VIOLATED, Progress
from comparison.execution.store import Row
from comparison.formatting import percent, quantity
from comparison.models import MODELS, made_on, platform_name, versions
from comparison.studies.campaign import population, stages, tables
from comparison.studies.campaign.adjudication import OPEN
from comparison.studies.campaign.figures import draw_distances, draw_places
from comparison.studies.campaign.opinions import FINE_SAMPLES, SMALL_STEP
from comparison.studies.campaign.screening import LIMIT, TIER
from comparison.studies.campaign.tables import Found
from comparison.studies.campaign.tasks import run_cases
from comparison.studies.campaign.third_engine import with_third_opinions
from comparison.studies.shared.study import Study

NAMES = {"reference": "the reference errs", "exudyn": "Exudyn's tree errs", OPEN: "open"}


def measure(count: int, n_jobs: int, on_progress: Progress | None) -> Found:
    """Examine so many scenes of the population."""
    cases = population.cases(count, population.SEED)
    found = list(zip(cases, run_cases(cases, n_jobs, on_progress), strict=True))
    return with_third_opinions(found, n_jobs)


def figures(found: Found, folder: Path) -> None:
    """Draw distances between the models, and where the scenes lie."""
    draw_distances(found, folder / "distances.svg")
    draw_places(found, folder / "places.svg")


def record(found: Found) -> dict[str, Any]:
    """Return all that was found, scene by scene."""
    return {
        "seed": population.SEED,
        "machine": platform_name(),
        "versions": versions(),
        "scenes": [{"scene": case.number, "drawn": case.family, **row} for case, row in found],
    }


def page(found: Found) -> dict[str, object]:
    """Return what stands in the page."""
    return {
        "outcome": outcome([row for _, row in found]),
        "seed": population.SEED,
        "machine": made_on(),
        "counts": tables.counts(found),
        "floor": percent(thresholds(TIER).coverage),
        "differences": tables.differences(found),
        "opinions": tables.opinions(found),
        "underestimated": tables.underestimated(found),
        "breaches": tables.breaches(found),
        "failures": tables.failures(found),
        "failed": tables.not_decided(found, stages.FAILED),
        "not_decided": tables.not_decided(found, stages.NOT_DECIDED),
        "mended": "\n\n".join(_entry(fault) for fault in mended()),
        "limit": quantity(LIMIT, "m"),
        "drawn": tables.drawn(found),
        "fine": FINE_SAMPLES,
        "step": quantity(SMALL_STEP, "s"),
        "seconds": tables.seconds(found),
        "ranges": ranges(),
        "shipped": ", ".join(population.SHIPPED),
        "moved": f"{population.MOVED:.0%}",
    }


def outcome(rows: Sequence[Row]) -> str:
    """Return what came of it in one paragraph."""
    count = Counter(row["outcome"] for row in rows)
    decided = count[stages.AGREE] + count[stages.UNDERESTIMATED] + count[stages.DIFFER]
    errs = Counter(NAMES[row["adjudication"]["errs"]] for row in rows if row["outcome"] == stages.DIFFER)
    who = ", ".join(f"{errs[words]} {words}" for words in NAMES.values())
    broken = Counter(model for row in rows for model in _broken(row))
    broke = " and ".join(f"{broken[model]} of the {model} model" for model in MODELS)
    runs = Counter(one["model"] for row in rows for one in row["failures"])
    failed = " and ".join(f"{runs[model]} of the {model} model" for model in MODELS)
    return (
        f"**Of {len(rows)} random scenes of {population.CYCLES:g} cycles {decided} are decided: "
        f"{count[stages.AGREE]} agree, in {count[stages.UNDERESTIMATED]} the uncertainty had been "
        f"underestimated, {count[stages.DIFFER]} differ ({who}).** In {count[stages.BROKEN]} others a run "
        f"breaks an invariant (of all scenes: {broke}). {count[stages.NOT_DECIDED]} are not decided for want "
        f"of predictable samples, {count[stages.FAILED]} cannot be compared; runs that did not succeed: "
        f"{failed}."
    )


def _broken(row: Row) -> set[str]:
    """Return the models of which a run of this scene breaks an invariant."""
    shown = {model for model, of in row["breaches"].items() if of}
    return shown | {one["model"] for one in row["failures"] if one["status"] == VIOLATED}


def mended() -> list[dict[str, Any]]:
    """Return the faults on record, see ``mended.toml``."""
    text = files("comparison.studies.campaign").joinpath("mended.toml").read_text("utf-8")
    faults: list[dict[str, Any]] = tomllib.loads(text)["fault"]
    return faults


def _entry(fault: dict[str, Any]) -> str:
    return (
        f"- **The {fault['model']} model {fault['fault']}.** How often: {fault['share']}. What revealed it: "
        f"{fault['seen']}. Mended: {fault['mended']}."
    )


def ranges() -> str:
    """Return what is drawn between which limits, in words."""
    spans = (
        ("speed", population.SPEED_RPM, 1.0, " rpm in either sense"),
        ("clearances", population.CLEARANCE, 1e3, " mm"),
        ("Young's modulus", population.MODULUS, 1e-9, " GPa"),
        ("corner radius", population.CORNER_RADIUS, 1e3, " mm"),
        ("Poisson's ratio", population.POISSON, 1.0, ""),
        ("restitution", population.RESTITUTION, 1.0, ""),
        ("of every second scene", population.BOUNCY, 1.0, ""),
        ("friction", population.FRICTION, 1.0, ""),
        ("gravity, where it is not the usual", population.GRAVITY_RANGE, 1.0, " m/s²"),
    )
    texts = [f"{name} {low * by:g} to {high * by:g}{unit}" for name, (low, high), by, unit in spans]
    modulus = " to ".join(f"{end * 1e-9:g}" for end in population.FOUNDATION_MODULUS)
    joints = ", ".join(f"{share:.0%} at the {name}" for name, share in population.JOINTS.items())
    return (
        "; ".join(texts)
        + "; any crank angle and any start between the walls; clearance "
        + joints.replace("the both", "both")
        + f"; {population.FOUNDATION_SHARE:.0%} under the law of a whole side, with {modulus} GPa"
    )


STUDY = Study(
    "campaign",
    small=5,  # scenes
    full=1280,
    measure=measure,
    page=page,
    draw=figures,
    data=record,
)
