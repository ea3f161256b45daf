"""Linear relation of two signals, with the errors of its coefficients."""

from dataclasses import dataclass
from math import inf, nan

import numpy as np

from comparison.tables.channels import Array, BoolArray

_BLOCKS = 20  # of the jackknife


@dataclass(frozen=True)
class Fit:
    """Coefficients of ``b = ratio * a + offset``, two standard errors of each, and the remainder."""

    ratio: float
    offset: float
    ratio_error: float
    offset_error: float
    left: float  # RMS of the remainder over that of b - a; nan without b - a, inf of multiples of zero


def fit(a: Array, b: Array, *, scaled: bool = False, moved: bool = False) -> Fit:
    """Fit b by a with a free ratio (``scaled``), a free offset (``moved``) or both, by least squares.

    Errors by the delete-one jackknife over blocks of the samples, whatever the correlation of the remainder
    within a block, and for what the numbers are rounded by.
    """
    if scaled and not a.any():
        return Fit(nan, nan, nan, nan, inf)
    design = np.column_stack([a] * scaled + [np.ones(a.size)] * moved)
    target = b if scaled else b - a
    count = min(_BLOCKS, a.size)
    blocks = np.arange(a.size) * count // a.size

    def solved(kept: BoolArray) -> Array:
        return np.asarray(np.linalg.lstsq(design[kept], target[kept], rcond=None)[0], dtype=np.float64)

    whole = solved(np.ones(a.shape, dtype=np.bool_))
    parts = np.array([solved(blocks != n) for n in range(count)])
    rounding = 4 * np.spacing(max(np.abs(a).max(), np.abs(b).max()))
    errors = 2 * np.sqrt((count - 1) * np.var(parts, axis=0))
    errors += rounding / np.sqrt(np.mean(design**2, axis=0))
    before, after = (float(np.sqrt(np.mean(rest**2))) for rest in (b - a, target - design @ whole))
    ratio, ratio_error = (float(whole[0]), float(errors[0])) if scaled else (1.0, 0.0)
    offset, offset_error = (float(whole[-1]), float(errors[-1])) if moved else (0.0, 0.0)
    return Fit(ratio, offset, ratio_error, offset_error, after / before if before else nan)
