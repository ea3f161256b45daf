"""Pages, tables and printed figures that several studies use."""

import pytest
from scipy.stats import beta

from comparison.studies.shared.published import published
from comparison.studies.shared.study import interval, share, upper_limit


def test_rates_and_their_limits():
    # Of Clopper and Pearson: quantiles of the beta distribution.
    assert interval(3, 40) == pytest.approx((beta.ppf(0.025, 3, 38), beta.ppf(0.975, 4, 37)))
    assert upper_limit(3, 40) == pytest.approx(beta.ppf(0.95, 4, 37))
    assert upper_limit(20, 20) == 1.0
    assert (interval(0, 0), upper_limit(0, 0)) == ((0.0, 1.0), 1.0)
    assert [share(rate) for rate in (0.0123, 0.9951)] == ["1.2\u00a0%", "99.5\u00a0%"]


@pytest.mark.parametrize(
    ("row", "value", "rounding"),
    [("F7-R-a", -494.9, 0.05), ("F7-T-d", 0.4112e-5, 0.5e-9), ("F14a-x", -0.2497e-3, 5e-8)],
)
def test_figures_come_from_the_published_table_with_half_a_unit_of_their_last_digit(row, value, rounding):
    figure = published(row)
    assert figure.value == value
    assert figure.rounding == pytest.approx(rounding, rel=1e-12)
