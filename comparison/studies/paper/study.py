"""The paper against both models: every printed figure, every drawing, every statement."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from comparison.formatting import quantity, table
from comparison.reliability.errors import QUANTITIES, unit_of
from comparison.scene import load_scene
from comparison.studies.nonlinear import chaos as nonlinear
from comparison.studies.nonlinear.study import STUDY as CHAOS
from comparison.studies.paper import figures, portraits, tables
from comparison.studies.paper.claims import criteria, judge_all
from comparison.studies.paper.ledger import ledger
from comparison.studies.paper.measures import REACH
from comparison.studies.paper.runs import CENTRAL, SCENES, Config, Runs, simulate
from comparison.studies.paper.tolerances import implied
from comparison.studies.shared.study import Study


def page(runs: Runs) -> dict[str, object]:
    """Return what stands in the page."""
    config, settings = runs.config, load_scene(CENTRAL).reliability
    return {
        **tables.of_ledger(ledger(runs)),
        **tables.of_first_cycle(runs),
        **tables.of_claims(judge_all(runs), criteria()),
        "tolerances": tables.of_tolerances(implied(runs)),
        "scenes": table(("scene", "title"), [[name, load_scene(name).title] for name in SCENES]),
        "limits": ", ".join(quantity(getattr(settings, of).upper, unit_of(of)) for of in QUANTITIES),
        "reach": f"{100 * REACH:g}",
        "members": config.members,
        "cycles": config.cycles,
        "fewer": config.fewer,
        "long_samples": f"{config.long_samples:,}",
        "samples": f"{config.samples:,}",
        "samples_value": config.samples,
        "central": CENTRAL,
    }


def draw(runs: Runs, folder: Path) -> None:
    """Draw the paper's figures."""
    figures.draw(runs, folder)
    portraits.draw(runs, folder)


def _central(config: nonlinear.Config) -> nonlinear.Config:
    """Return what the study nonlinear runs of the central case alone."""
    return replace(config, scenes=(CENTRAL,), swept={})


STUDY = Study(
    "paper",
    small=Config(samples=100, long_samples=50, cycles=4, fewer=3, members=2, chaos=_central(CHAOS.small)),
    full=Config(
        samples=10_000,
        long_samples=1000,
        cycles=100,
        fewer=30,
        members=4,
        chaos=_central(CHAOS.full),
    ),
    measure=simulate,
    page=page,
    draw=draw,
    one_file=True,
)
