"""The panel that most figures have: curves or points, a look for each value of a column."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd
from matplotlib.axes import Axes

Looks = Mapping[Any, Mapping[str, Any]]
"""Value of a column -> how `matplotlib.axes.Axes.plot` shows its rows."""


def curves(axes: Axes, frame: pd.DataFrame, x: str, y: str, by: Any, looks: Looks, **settings: Any) -> None:
    """Draw a column over another: of each value of a third (or tuple of several) a line or its points.

    Parameters
    ----------
    axes, frame, x, y
        Panel, rows and columns.
    by, looks
        Whose values have a look each, in whose order they are drawn, also those without any row, for the
        legend; values without a look are left out. The label is the value, if the look has none.
    settings
        Of the panel, as `matplotlib.axes.Axes.set` takes them.
    """
    groups = dict(list(frame.groupby(by, sort=False)))
    for key, look in looks.items():
        rows = groups.get(key, frame.iloc[:0])
        axes.plot(rows[x], rows[y], **{"label": str(key), **look})
    axes.set(**settings)
