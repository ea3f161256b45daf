"""The observed order of convergence from three levels."""

from collections.abc import Callable

import numpy as np
import pytest

from comparison.accuracy.uncertainty import Runs
from comparison.scene import Scene
from comparison.tables.table import Table
from comparison.verdict.attribution import observed_order
from comparison.verdict.compare import compare


def levels(make_table: Callable[..., Table], power: float, factor: float = 2.0) -> Runs:
    """Return three levels whose errors follow the setting to this power."""
    coarse, base, fine = (make_table(error=1e-6 * factor ** (-power * n)) for n in range(3))
    return Runs(base=base, finer=fine, coarser=coarse, refinement=(factor, 2.0))


@pytest.mark.parametrize("power", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("factor", [2.0, 10.0])
def test_the_power_of_the_error_is_found(
    make_table: Callable[..., Table], scene: Scene, power: float, factor: float
) -> None:
    runs = levels(make_table, power, factor)
    result = compare(runs, runs, scene=scene, labels=("a", "b"))
    # Differences of 1e-14 of channels of size 1 are known to a hundredth; errors are exact multiples.
    assert observed_order(runs, result.channels) == pytest.approx(power, abs=0.02)


def test_equal_or_missing_levels_have_no_order(make_table: Callable[..., Table], scene: Scene) -> None:
    runs = levels(make_table, 2.0)
    result = compare(runs, runs, scene=scene, labels=("a", "b"))
    for lacking in (
        Runs(base=runs.base, finer=runs.finer),
        Runs(base=runs.base, finer=runs.base, coarser=runs.coarser),
        Runs(base=runs.base, finer=runs.finer, coarser=runs.base),
    ):
        assert np.isnan(observed_order(lacking, result.channels))


def test_the_comparison_holds_the_orders_of_both_models(
    make_table: Callable[..., Table], scene: Scene
) -> None:
    a, b = levels(make_table, 1.0), levels(make_table, 2.0)
    first, second = compare(a, b, scene=scene, labels=("reference", "exudyn")).attribution.refinements
    assert (first.observed, first.order) == pytest.approx((1.0, 2.0), abs=0.02)
    assert (second.observed, second.order) == pytest.approx((2.0, 2.0), abs=0.02)
