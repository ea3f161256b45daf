r"""Difference of two models' reliabilities and its significance, and what is run for it.

Both models compute the same press from the same start, so their difference D has three sources of
uncertainty:

- *numerical*: the reliability is also evaluated from the finer, the coarser and the perturbed runs of each
  model, and their distances give u as those of any channel do (`comparison.accuracy.uncertainty`). Where
  neighbouring runs diverge, the reliability of a perturbed run is that of another trajectory, which u
  includes. The ideal mechanism's own error enters in the same way, by a coarser run of it.
- *sampling*: how far the difference would move with other cycles. Paired, since the errors of both models at
  one instant belong together: the standard error is that of the average of the difference of what each error
  changes (`comparison.reliability.assessment.sensitivity`), bin by bin; nothing is left where both follow one
  course. Where the smallest reliabilities of the two are in different bins there are no pairs, and the
  squares of both add up.
- *quadrature*: what the samples leave open of time averages (`comparison.reliability.averages`), paired too.

The interval is :math:`D \pm \sqrt{s^2 + (k u)^2 + q^2}` with s and q the half-widths of 95 % and k = 2 as for
any channel.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import ceil

import numpy as np

from comparison.accuracy.levels import coarser
from comparison.accuracy.uncertainty import ROUND_OFF, Levels, Runs, uncertainty
from comparison.execution.run import Job, Outcome
from comparison.reliability.assessment import Assessment, assess
from comparison.reliability.errors import slider_errors
from comparison.scene import Scene, load_scene
from comparison.scene.loading import BASE
from comparison.scene.schema import ExudynSolver, ReferenceSolver
from comparison.scene.schema import Reliability as Settings
from comparison.tables.arrays import Array
from comparison.tables.table import Table, TableError

MARGIN = 1e-3
"""Of reliability: an interval that reaches further leaves it undecided whether two models agree. It is of the
size by which the paper's cases differ."""
STEPS = 10_000
"""Exudyn's steps per crank cycle of an ideal mechanism, fixed. Constraints alone move it: positions are right
to 1e-12 m whatever the step, velocities to 1e-7 m/s and accelerations to 5e-7 m/s^2 at 150 rpm (of order
step^2), measured against the closed form. The step of 2e-6 s for a clearance would cost twenty times as much.
"""
DENSE = 10_000
"""Samples per crank cycle at least, of which the reliability is computed: contacts last some 5 intervals. On
1,000 R of the central case's acceleration is wrong by 4e-4, on these by 6e-7."""
MOST = 400_000
"""Samples of a run at most, some 80 MB: of a run of more than 40 cycles fewer are taken a cycle."""
_WITHOUT_MEANING = ("clearance", "contact", "friction", "initial", "environment")


@dataclass(frozen=True)
class Difference:
    """One quantity's reliability in two models; arrays of shape (k bins,).

    Attributes
    ----------
    a, b
        Each model's.
    curve
        R_a - R_b in each bin.
    curve_half_width
        Of its interval, all sources together; nan where a model has no numerical uncertainty.
    minimum
        The smallest of R_a's bins less the smallest of R_b's.
    sampling, numerical, quadrature
        Half-widths of its interval by source; the second nan as above.
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
        """Verdict by the interval.

        ``"differ"``: it does not hold zero. ``"agree"``: it does, and reaches no further than `MARGIN`.
        ``"undecided"``: it does, but reaches further, or there is none.
        """
        if abs(self.minimum) > self.half_width:
            return "differ"
        return "agree" if abs(self.minimum) + self.half_width <= MARGIN else "undecided"


@dataclass(frozen=True)
class FailedRun:
    """A run that the reliability needs and that did not succeed: with more samples, or of the ideal."""

    job: Job
    outcome: Outcome
    ideal: bool


@dataclass(frozen=True)
class ReliabilityComparison:
    """A scene's reliability in two models.

    Attributes
    ----------
    settings
        ``[reliability]`` of the scene.
    quantities
        Quantity -> its reliabilities; empty where there is no ideal mechanism to measure errors against.
    missing
        What prevented it then.
    """

    settings: Settings
    quantities: dict[str, Difference] = field(default_factory=dict)
    missing: FailedRun | TableError | None = None

    @property
    def verdict(self) -> str:
        """The worst of the quantities': differ, undecided, agree; ``"undecided"`` where there is none."""
        verdicts = {difference.verdict for difference in self.quantities.values()} or {"undecided"}
        return next(verdict for verdict in ("differ", "undecided", "agree") if verdict in verdicts)


def dense_scene(scene: Scene) -> Scene:
    """Return a scene with at least `DENSE` samples a cycle, a whole multiple of its own.

    Without forces at corners, which nobody reads there. The steps of a run do not depend on its samples, but
    for those of five bodies, which are whole parts of a sample interval.
    """
    output, cycles = scene.data["output"], scene.data["drive"]["cycles"]
    own = int(output["samples_per_cycle"])
    times = max(1, min(ceil(DENSE / own), int(MOST / (own * cycles))))
    groups = dict.fromkeys(["accelerations", *(name for name in output["groups"] if name != "corners")])
    return scene.variant({"output.samples_per_cycle": own * times, "output.groups": list(groups)})


def ideal_scenes(scene: Scene, model: str) -> dict[str, Scene]:
    """Return the same scene with ideal joints, by its name in `comparison.accuracy.uncertainty.Runs`.

    Speed and bodies are the scene's, samples those of `dense_scene`, but a coarser run's the scene's. What
    does not affect a motion that the drive alone prescribes is set to one value, also gravity and the
    settings of our two models: scenes that differ in nothing else share the run. The reference model has a
    closed form of the ideal mechanism; Exudyn moves its five bodies, in `STEPS` steps per cycle. An installed
    model keeps its settings.

    Returns
    -------
    scenes
        ``"base"`` and, where the model can be refined, ``"coarser"``, which gives its uncertainty.
    """
    base = load_scene(BASE).data
    values: dict[str, object] = {
        f"{section}.{key}": value for section in _WITHOUT_MEANING for key, value in base[section].items()
    }
    for name, solver in (
        ("reference", ReferenceSolver()),
        ("exudyn", ExudynSolver(step=scene.period / STEPS)),
    ):
        values |= {f"solver.{name}.{key}": value for key, value in solver.model_dump().items()}
    values |= {"joints.slider": "ideal", "joints.crank_pin": "ideal", "output.groups": ["accelerations"]}
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
    """Compare the reliabilities of two models.

    Parameters
    ----------
    runs
        Of each model; without a finer run it has no numerical uncertainty.
    ideals
        The ideal mechanism by each model; a coarser run beside it gives its uncertainty.
    period
        Of a crank cycle, s.
    settings
        ``[reliability]`` of the scene.
    k
        How many numerical uncertainties explain a difference.
    start
        Of the first cycle that counts, s.

    Returns
    -------
    differences
        By quantity: those whose channels the tables hold.

    Raises
    ------
    TableError
        If the tables cannot be compared with the ideal mechanism's (`slider_errors`) or with each other.
    """

    def assessed(table: Table, ideal: Table) -> dict[str, Assessment]:
        return assess(slider_errors(table, ideal, period, start=start), settings)

    def numerical(runs: Runs, ideal: Runs, own: dict[str, Assessment]) -> dict[str, Array]:
        """Return each quantity's u in every bin and, last, that of the smallest; shape (k bins + 1,)."""
        by_run = {kind: assessed(table, ideal.base) for kind, table in _others(runs)}
        by_ideal = {kind: assessed(runs.base, table) for kind, table in _others(ideal)}
        return {
            quantity: np.hypot(
                _uncertainty(base, {kind: by[quantity] for kind, by in by_run.items()}, runs),
                _uncertainty(base, {kind: by[quantity] for kind, by in by_ideal.items()}, ideal),
            )
            for quantity, base in own.items()
        }

    first, second = (assessed(model.base, ideal.base) for model, ideal in zip(runs, ideals, strict=True))
    a_cycles, b_cycles = ([(name, *bins.cycles) for name, bins in model.items()] for model in (first, second))
    if a_cycles != b_cycles:
        raise TableError("the two results: cover other parts of the cycles, or hold other channels")
    u_first, u_second = (numerical(*sides) for sides in zip(runs, ideals, (first, second), strict=True))
    differences = {}
    for quantity, a in first.items():
        b = second[quantity]
        wide = k * np.hypot(u_first[quantity], u_second[quantity])
        left = [
            of_a.less(of_b, density_a, density_b)
            for of_a, of_b, density_a, density_b in zip(
                a.left_open, b.left_open, a.density.tolist(), b.density.tolist(), strict=True
            )
        ]
        sampling = np.array([part.sampling for part in left])
        quadrature = np.array([part.quadrature for part in left])
        paired = a.worst == b.worst
        differences[quantity] = Difference(
            a=a,
            b=b,
            curve=a.reliability - b.reliability,
            curve_half_width=np.linalg.norm([sampling, quadrature, wide[:-1]], axis=0),
            minimum=a.minimum - b.minimum,
            sampling=float(sampling[a.worst]) if paired else _apart(a, b, "sampling"),
            numerical=float(wide[-1]),
            quadrature=float(quadrature[a.worst]) if paired else _apart(a, b, "quadrature"),
        )
    return differences


def _apart(a: Assessment, b: Assessment, source: str) -> float:
    """Return the half-width of the difference of the smallest reliabilities, in bins of their own."""
    parts = (model.density[model.worst] * getattr(model.left_open[model.worst], source) for model in (a, b))
    return float(np.hypot(*parts))


def _others(runs: Runs) -> Iterator[tuple[str, Table]]:
    for kind in ("finer", "coarser", "perturbed", "other_perturbed"):
        if (table := getattr(runs, kind)) is not None:
            yield kind, table


def _uncertainty(base: Assessment, others: dict[str, Assessment], runs: Runs) -> Array:
    """Evaluate u in every bin and of the smallest from the available runs; nan if there is no other."""
    own = np.append(base.reliability, base.minimum)
    known = {kind: np.append(other.reliability, other.minimum) for kind, other in others.items()}
    if not known:
        return np.full(own.shape, np.nan)
    finer = known.get("finer", own)  # without one the coarser run decides alone
    perturbed = tuple(known[kind] for kind in ("perturbed", "other_perturbed") if kind in known)
    levels = Levels(own, finer, known.get("coarser"), perturbed, *runs.refinement)
    return uncertainty(levels, half_width=0, floor=ROUND_OFF)
