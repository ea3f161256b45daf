"""The runs with clearance at the crank pin A: ensembles, other samplings, Exudyn, the ideal mechanism."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from math import degrees

from comparison.execution.run import Job, Outcome, Progress, run_all, successful
from comparison.scene import Scene, load_scene
from comparison.studies.crank_pin.peaks import Case, summarise
from comparison.studies.shared.errors import shift_bound
from comparison.tables.arrays import Array
from comparison.tables.table import Table

Values = dict[str, object]

BASE = "150rpm-0.2mm"
RADIUS, MODULUS = "clearance.journal_radius", "contact.youngs_modulus"
TOLERANCE = "solver.reference.tolerance"
SHOWN = (RADIUS, 10e-3)
NUDGE = 1e-7
"""Degrees of the crank from one member to the next: less than 1e-9 m of the ideal slider in all of them."""


@dataclass(frozen=True)
class Config:
    """What is varied and how often it runs."""

    varied: Mapping[str, Sequence[float]]
    """Key -> its values; each is run as an ensemble."""
    members: int
    """Runs in an ensemble."""
    samples: int
    """A cycle, of all runs but those of `samplings`."""
    samplings: tuple[int, ...]
    """Samples a cycle of one run each."""


@dataclass(frozen=True)
class Runs:
    """What was run."""

    config: Config
    members: dict[tuple[str, float], list[Outcome]]
    """(key, value) of what is varied -> the runs of its ensemble."""
    sampled: dict[int, Outcome]
    """Samples a cycle -> the run of the scene as it is."""
    exudyn: dict[float, Outcome]
    """Journal radius (m) -> Exudyn's run."""
    smooth: Outcome
    """The largest journal without friction."""
    still: dict[int, Table]
    """Samples a cycle -> the ideal mechanism's run."""
    bound: Array
    """What a rigid shift of the pin by its clearance moves the slider by, m."""

    @property
    def shown(self) -> Table:
        """The first run of the ensemble `SHOWN`."""
        return next(outcome.table for outcome in self.members[SHOWN] if outcome.table is not None)

    def by_value(self, key: str) -> dict[float, Case]:
        """Return the ensembles in which one key is varied, by its value."""
        still, period = self.still[self.config.samples], scene({}).period
        of_key = {value: outcomes for (varied, value), outcomes in self.members.items() if varied == key}
        return {value: summarise(outcomes, still, period) for value, outcomes in of_key.items()}


def scene(values: Values, samples: int = 1000, member: int = 0) -> Scene:
    """Return two cycles with clearance at A only."""
    fixed: Values = {
        "joints.slider": "ideal",
        "joints.crank_pin": "clearance",
        "mechanism.crank_angle_deg": load_scene(BASE).data["mechanism"]["crank_angle_deg"] + member * NUDGE,
        "output.groups": ["accelerations"],
        "output.samples_per_cycle": samples,
    }
    return load_scene(BASE, fixed | values)


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Runs:
    """Run the ensembles, the ideal mechanism and Exudyn in one go.

    Raises
    ------
    RunError
        If the ideal mechanism, of which nothing can fail, does.
    """
    varied, count, samples, samplings = config.varied, config.members, config.samples, config.samplings
    which = [(key, value) for key, values in varied.items() for value in values]
    radii = varied[RADIUS]
    jobs = [Job(scene({key: value}, samples, k), "reference") for key, value in which for k in range(count)]
    jobs += [Job(scene({}, each), "reference") for each in samplings]
    jobs += [Job(scene({RADIUS: radius}, samples), "exudyn") for radius in radii]
    jobs += [Job(scene({RADIUS: radii[-1], "friction.coefficient": 0.0}, samples), "reference")]
    still: Values = {"joints.crank_pin": "ideal"}
    ideal = [Job(scene(still, each), "reference") for each in samplings]
    ideal += [Job(scene(still | values, samples), "reference") for values in _shifts()]
    outcomes = iter(run_all([*jobs, *ideal], n_jobs, on_progress))
    members = {key: list(islice(outcomes, count)) for key in which}
    sampled = dict(zip(samplings, islice(outcomes, len(samplings)), strict=True))
    exudyn = dict(zip(radii, islice(outcomes, len(radii)), strict=True))
    smooth = next(outcomes)
    tables = list(map(successful, outcomes, ideal))
    *_, longer, shorter, ahead, behind = (run.values("slider_y") for run in tables)
    clearance = float(scene({}).data["clearance"]["crank_pin"])
    bound = shift_bound((longer, shorter), (ahead, behind), clearance / 10, clearance)
    return Runs(config, members, sampled, exudyn, smooth, dict(zip(samplings, tables, strict=False)), bound)


def _shifts() -> list[Values]:
    """Return the crank longer and shorter, ahead and behind, by a tenth of the clearance."""
    data = scene({}).data
    crank, angle = data["mechanism"]["crank"]["length"], data["mechanism"]["crank_angle_deg"]
    step = data["clearance"]["crank_pin"] / 10
    return [{"mechanism.crank.length": crank + sign * step} for sign in (1, -1)] + [
        {"mechanism.crank_angle_deg": angle + sign * degrees(step / crank)} for sign in (1, -1)
    ]
