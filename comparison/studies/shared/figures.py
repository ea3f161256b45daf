"""The panel that most figures have: curves or points, a look for each value of a column."""

from collections.abc import Mapping
from typing import Any

import pandas as pd
from matplotlib.axes import Axes


def curves(
    axes: Axes,
    frame: pd.DataFrame,
    x: str,
    y: str,
    by: Any,
    looks: Mapping[Any, Mapping[str, Any]],
    **settings: Any,
) -> None:
    """Draw column y over x, a line or points for each value of the column(s) ``by`` that has a look.

    In the order of the looks, which are options of `matplotlib.axes.Axes.plot`; a look without rows is in the
    legend. The settings are those of the panel, as `matplotlib.axes.Axes.set` takes them.
    """
    groups = dict(list(frame.groupby(by, sort=False)))
    for key, look in looks.items():
        rows = groups.get(key, frame.iloc[:0])
        axes.plot(rows[x], rows[y], **{"label": str(key), **look})
    axes.set(**settings)
