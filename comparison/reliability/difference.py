"""Difference of two models' reliabilities and its significance, and what is run for it.

It has three uncertainties, whose squares add up. Numerical: the distances of the reliabilities from the
finer, the coarser and the perturbed runs of each model, and from a coarser ideal mechanism, as those of any
channel (`comparison.accuracy.uncertainty`). Sampling: how far it would move with other cycles, paired, since
the errors of both models at one instant belong together. Quadrature: what the samples leave open of time
averages, paired too. Where the smallest reliabilities of the two are in different bins there are no pairs.
"""

from dataclasses import dataclass, field, replace
from math import ceil

import numpy as np

from comparison.accuracy.levels import coarser
from comparison.accuracy.uncertainty import ROUND_OFF, Levels, Runs, uncertainty
from comparison.execution.run import RunError
from comparison.reliability.assessment import Assessment, assess
from comparison.reliability.errors import slider_errors
from comparison.scene import Scene, load_scene
from comparison.scene.loading import BASE
from comparison.scene.schema import ExudynSolver, ReferenceSolver
from comparison.scene.schema import Reliability as Settings
from comparison.tables.align import SAME_GRID
from comparison.tables.channels import Array, expected
from comparison.tables.table import Table, TableError

MARGIN = 1e-3  # of reliability: an interval that reaches further leaves open whether two models agree
STEPS = 10_000
"""Exudyn's steps per crank cycle of an ideal mechanism: positions err by 1e-12 m, velocities by 1e-7 m/s and
accelerations by 5e-7 m/s^2 at 150 rpm (measured against the closed form)."""
DENSE = 10_000
"""Samples per crank cycle at least: of the central case R errs by 6e-7 (acceleration), on 1,000 by 4e-4."""
MOST = 400_000  # samples of a run, some 80 MB
_WITHOUT_MEANING = ("clearance", "contact", "friction", "initial", "environment")


@dataclass(frozen=True)
class Difference:
    """One quantity's reliability in two models.

    ``curve`` is R_a - R_b in each bin, ``minimum`` the difference of the smallest, both with half-widths of
    their intervals, nan where a model has no numerical uncertainty.
    """

    a: Assessment
    b: Assessment
    curve: Array
    curve_half_width: Array
    minimum: float
    sampling: float
    numerical: float
    quadrature: float

    @property
    def half_width(self) -> float:
        """Of the interval of `minimum`."""
        return float(np.linalg.norm([self.sampling, self.numerical, self.quadrature]))

    @property
    def verdict(self) -> str:
        """Whether the interval excludes zero, is within `MARGIN`, or neither."""
        if abs(self.minimum) > self.half_width:
            return "differ"
        return "agree" if abs(self.minimum) + self.half_width <= MARGIN else "undecided"


@dataclass(frozen=True)
class ReliabilityComparison:
    """A scene's reliability in two models, by quantity, or what prevented it, such as a run that failed."""

    settings: Settings
    quantities: dict[str, Difference] = field(default_factory=dict)
    missing: RunError | TableError | None = None

    @property
    def verdict(self) -> str:
        """The worst of the quantities'; "undecided" where there is none."""
        verdicts = {difference.verdict for difference in self.quantities.values()} or {"undecided"}
        return next(verdict for verdict in ("differ", "undecided", "agree") if verdict in verdicts)


def dense_scene(scene: Scene) -> Scene:
    """Return a scene with at least `DENSE` samples a cycle, a whole multiple of its own."""
    output, cycles = scene.data["output"], scene.data["drive"]["cycles"]
    own = int(output["samples_per_cycle"])
    times = max(1, min(ceil(DENSE / own), int(MOST / (own * cycles))))
    groups = dict.fromkeys(["accelerations", *output["groups"]])
    return scene.variant({"output.samples_per_cycle": own * times, "output.groups": list(groups)})


def at_own_samples(table: Table, scene: Scene) -> Table:
    """Return a run of `dense_scene` with the samples and channels of the scene itself."""
    own = scene.data["output"]["samples_per_cycle"]
    every = dense_scene(scene).data["output"]["samples_per_cycle"] // own
    names = [name for name in ("time", *expected(scene.data)) if name in table.frame]
    frame = table.frame.loc[::every, names].reset_index(drop=True)
    # As a run with these samples counts its times, to the last digit: those of an ensemble must be the same.
    interval = scene.period / own
    grid = np.arange(len(frame)) * interval
    if np.allclose(frame["time"], grid, rtol=0.0, atol=SAME_GRID * interval):
        frame["time"] = grid
    return replace(
        table,
        frame=frame,
        extrema={name: extremes for name, extremes in table.extrema.items() if name in names},
        provenance=table.provenance | {"scene_hash": scene.hash, "scene": scene.data},
    )


def ideal_scenes(scene: Scene, model: str) -> dict[str, Scene]:
    """Return the same scene with ideal joints: "base" and, where the model can be refined, "coarser".

    Samples are those of `dense_scene`, but a coarser run's the scene's. What does not affect a motion that
    the drive alone prescribes is set to one value, also the settings of our two models: scenes that differ in
    nothing else share the run.
    """
    base = load_scene(BASE).data
    sections = {section: base[section] for section in _WITHOUT_MEANING} | {
        "solver.reference": ReferenceSolver().model_dump(),
        "solver.exudyn": ExudynSolver(step=scene.period / STEPS).model_dump(),
        "joints": {"slider": "ideal", "crank_pin": "ideal"},
        "output": {"groups": ["accelerations"]},
    }
    values = {f"{section}.{key}": value for section, keys in sections.items() for key, value in keys.items()}
    ideal = scene.variant(values)
    coarse = coarser(model, ideal)
    # Its step, twice that of the other, would not fit between dense samples
    return {"base": dense_scene(ideal)} | ({} if coarse is None else {"coarser": coarse})


def compare_reliability(
    runs: tuple[Runs, Runs],
    ideals: tuple[Runs, Runs],
    period: float,
    settings: Settings,
    k: float,
    start: float = 0.0,
) -> dict[str, Difference]:
    """Compare the reliabilities of two models, by quantity, of their runs and ideal mechanisms.

    ``k`` numerical uncertainties explain a difference; the first cycle that counts starts at ``start`` (s). A
    `TableError` if the tables cannot be compared.
    """

    def assessed(run: Table, ideal: Table) -> dict[str, Assessment]:
        return assess(slider_errors(run, ideal, period, start=start), settings)

    def numerical(runs: Runs, ideal: Runs, own: dict[str, Assessment]) -> dict[str, Array]:
        """Return each quantity's u in every bin and, last, that of the smallest; shape (k bins + 1,)."""
        by_run, by_ideal = {"base": own}, {"base": own}
        by_run |= {
            which: assessed(table, ideal.base) for which, table in runs.tables.items() if which != "base"
        }
        by_ideal |= {
            which: assessed(runs.base, table) for which, table in ideal.tables.items() if which != "base"
        }
        return {
            name: np.hypot(
                _uncertainty(name, by_run, runs.refinement), _uncertainty(name, by_ideal, ideal.refinement)
            )
            for name in own
        }

    first, second = (assessed(model.base, ideal.base) for model, ideal in zip(runs, ideals, strict=True))
    a_cycles, b_cycles = ([(name, *bins.cycles) for name, bins in model.items()] for model in (first, second))
    if a_cycles != b_cycles:
        raise TableError("the two results: cover other parts of the cycles, or hold other channels")
    u_first, u_second = (numerical(*sides) for sides in zip(runs, ideals, (first, second), strict=True))
    return {
        name: _difference(a, second[name], k * np.hypot(u_first[name], u_second[name]))
        for name, a in first.items()
    }


def _difference(a: Assessment, b: Assessment, numerical: Array) -> Difference:
    bins = zip(a.left_open, b.left_open, a.density.tolist(), b.density.tolist(), strict=True)
    paired = [left_a.less(left_b, density_a, density_b) for left_a, left_b, density_a, density_b in bins]
    open_by_bin = np.array([(left.sampling, left.quadrature) for left in paired])
    sampling, quadrature = open_by_bin[a.worst]
    if a.worst != b.worst:
        worst = [(model.density[model.worst], model.left_open[model.worst]) for model in (a, b)]
        sampling = np.hypot(*(density * left.sampling for density, left in worst))
        quadrature = np.hypot(*(density * left.quadrature for density, left in worst))
    return Difference(
        a=a,
        b=b,
        curve=a.reliability - b.reliability,
        curve_half_width=np.linalg.norm([*open_by_bin.T, numerical[:-1]], axis=0),
        minimum=a.minimum - b.minimum,
        sampling=float(sampling),
        numerical=float(numerical[-1]),
        quadrature=float(quadrature),
    )


def _uncertainty(name: str, runs: dict[str, dict[str, Assessment]], refinement: tuple[float, float]) -> Array:
    values = {which: np.append(own[name].reliability, own[name].minimum) for which, own in runs.items()}
    base = values.pop("base")
    if not values:
        return np.full(base.shape, np.nan)
    finer = values.pop("finer", base)  # without one the coarser run decides alone
    levels = Levels(base, finer, values.pop("coarser", None), tuple(values.values()), *refinement)
    return uncertainty(levels, half_width=0, floor=ROUND_OFF)
