r"""Difference of two models' reliabilities and its significance.

Both models compute the same press from the same start, so their difference D has three sources of
uncertainty:

- *numerical*: the reliability is also evaluated from the finer, the coarser and the perturbed runs of each
  model, and their distances give u as those of any channel do (`comparison.accuracy.uncertainty`). Where
  neighbouring runs diverge, the reliability of a perturbed run is that of another trajectory, which u
  includes. The ideal mechanism's own error enters in the same way, by a coarser run of it.
- *sampling*: how far the difference would move with other cycles. Paired, since the errors of both models at
  one instant belong together: the standard error is that of the average of the difference of what each error
  changes (`interference.sensitivity`), bin by bin; nothing is left where both follow one course. Where the
  smallest reliabilities of the two are in different bins there are no pairs, and the squares of both add up.
- *quadrature*: what the samples leave open of time averages (`comparison.reliability.averages`), paired too.

The interval is :math:`D \pm \sqrt{s^2 + (k u)^2 + q^2}` with s and q the half-widths of 95 % and k = 2 as for
any channel.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from comparison.accuracy.uncertainty import ROUND_OFF, Levels, Runs, uncertainty
from comparison.reliability.assessment import Assessment, assess
from comparison.reliability.errors import slider_errors
from comparison.scene.schema import Reliability as Settings
from comparison.tables.arrays import Array
from comparison.tables.table import Table, TableError

MARGIN = 1e-3
"""Of reliability: an interval that reaches further leaves it undecided whether two models agree. It is of the
size by which the paper's cases differ."""


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
class ReliabilityComparison:
    """A scene's reliability in two models.

    Attributes
    ----------
    settings
        ``[reliability]`` of the scene.
    quantities
        Quantity -> its reliabilities; empty where there is no ideal mechanism to measure errors against.
    missing
        Why, in one line.
    """

    settings: Settings
    quantities: dict[str, Difference] = field(default_factory=dict)
    missing: str = ""

    @property
    def verdict(self) -> str:
        """The worst of the quantities': differ, undecided, agree; ``"undecided"`` where there is none."""
        found = {difference.verdict for difference in self.quantities.values()} or {"undecided"}
        return next(verdict for verdict in ("differ", "undecided", "agree") if verdict in found)


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
    dict of Difference
        By quantity: those whose channels the tables hold.

    Raises
    ------
    TableError
        If the tables cannot be compared with the ideal mechanism's (`slider_errors`) or with each other.
    """
    pairs = list(zip(runs, ideals, strict=True))
    assessed = [
        assess(slider_errors(of.base, ideal.base, period, start=start), settings) for of, ideal in pairs
    ]
    if len({tuple((name, *of.cycles) for name, of in each.items()) for each in assessed}) > 1:
        raise TableError("the two results: cover other parts of the cycles, or hold other channels")
    numerical = [_numerical(of, ideal, period, settings, start) for of, ideal in pairs]
    found = {}
    for quantity in assessed[0]:
        a, b = (of[quantity] for of in assessed)
        wide = k * np.hypot(*(of[quantity] for of in numerical))
        sampling, quadrature = _paired(a, b)
        i, j = a.worst, b.worst
        found[quantity] = Difference(
            a=a,
            b=b,
            curve=a.reliability - b.reliability,
            curve_half_width=np.linalg.norm([sampling, quadrature, wide[:-1]], axis=0),
            minimum=a.minimum - b.minimum,
            sampling=float(sampling[i]) if i == j else _apart(a, b, "sampling"),
            numerical=float(wide[-1]),
            quadrature=float(quadrature[i]) if i == j else _apart(a, b, "quadrature"),
        )
    return found


def _paired(a: Assessment, b: Assessment) -> tuple[Array, Array]:
    """Return the half-widths that cycles and samples leave of R_a - R_b, shape (k bins,) each."""
    both = zip(a.left_open, b.left_open, a.density, b.density, strict=True)
    left = [of_a.less(of_b, *densities) for of_a, of_b, *densities in both]
    return np.array([of.sampling for of in left]), np.array([of.quadrature for of in left])


def _apart(a: Assessment, b: Assessment, source: str) -> float:
    """Return the half-width of the difference of the smallest reliabilities, in bins of their own."""
    return float(np.hypot(*(of.density[of.worst] * getattr(of.left_open[of.worst], source) for of in (a, b))))


def _numerical(runs: Runs, ideal: Runs, period: float, settings: Settings, start: float) -> dict[str, Array]:
    """Return each quantity's u in every bin and, last, that of the smallest; shape (k bins + 1,)."""

    def reliabilities(table: Table, still: Table) -> dict[str, Array]:
        found = assess(slider_errors(table, still, period, start=start), settings)
        return {quantity: np.append(of.reliability, of.minimum) for quantity, of in found.items()}

    of_runs = {kind: reliabilities(table, ideal.base) for kind, table in _kinds(runs)}
    of_ideal = {kind: reliabilities(runs.base, table) for kind, table in _kinds(ideal)}
    return {
        quantity: np.hypot(_uncertainty(of_runs, quantity, runs), _uncertainty(of_ideal, quantity, ideal))
        for quantity in of_runs["base"]
    }


def _kinds(runs: Runs) -> Iterator[tuple[str, Table]]:
    for kind in ("base", "finer", "coarser", "perturbed", "other_perturbed"):
        if (table := getattr(runs, kind)) is not None:
            yield kind, table


def _uncertainty(of: dict[str, dict[str, Array]], quantity: str, runs: Runs) -> Array:
    """Evaluate u from the available runs; nan if there is only one."""
    known = {kind: values[quantity] for kind, values in of.items()}
    base = known["base"]
    if len(known) == 1:
        return np.full(base.shape, np.nan)
    finer = known.get("finer", base)  # without one the coarser run decides alone
    perturbed = tuple(known[kind] for kind in ("perturbed", "other_perturbed") if kind in known)
    levels = Levels(base, finer, known.get("coarser"), perturbed, *runs.refinement)
    return uncertainty(levels, half_width=0, floor=ROUND_OFF)
