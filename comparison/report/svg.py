"""Figures of matplotlib as SVG in the colours of a page, and curves thinned to the resolution of a figure.

Only drawings import it: a page with stored drawings does not need it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import StringIO
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from comparison.files import write_text
from comparison.tables.channels import Array, BoolArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

STYLE = Path(__file__).with_name("assets") / "sixbar.mplstyle"
COLUMNS = 400
"""Columns of a figure: about its width in points."""
# Figures have the colours of a light page, from the first rule of its style sheet. On a page, roles
# replace these; in dark mode roles have other colours.
_ROLES: dict[str, str] = dict(
    re.findall(
        r"--([\w-]+): (#[0-9a-f]{6})", STYLE.with_name("report.css").read_text("utf-8").partition("}")[0]
    )
)
INK, GRID, FIRST, SECOND = (_ROLES[role] for role in ("ink", "grid", "first", "second"))
DIFFERENCE, THRESHOLD, SHADE = (_ROLES[role] for role in ("difference", "threshold", "shade"))
OUTSIDE, LIMIT = _ROLES["outside"], _ROLES["limit"]
SERIES = tuple(_ROLES[f"series-{n}"] for n in range(1, 7))
"""Colours of scenes, laws, classes (not of models), as many as a reader can distinguish."""
_IN_FIGURES = (INK, GRID, FIRST, SECOND, THRESHOLD, SHADE, OUTSIDE, LIMIT, *SERIES)
MODEL_LINES: tuple[dict[str, Any], ...] = (
    {"color": FIRST, "lw": 3.6, "alpha": 0.5},
    {"color": SECOND, "lw": 1.2},
)
"""Curves of the first and the second model over each other: a thin line on a wide one shows both where they
coincide; dashes on a solid line of another colour look grey there."""
SERIES_LINES: tuple[dict[str, Any], ...] = tuple(
    {"color": colour, "lw": width}
    for colour, width in zip(SERIES, (2.4, 1.9, 1.5, 1.1, 0.9, 0.8), strict=True)
)
"""Curves of `SERIES` over each other; the first ones are the widest, and stay visible."""


@contextmanager
def style() -> Iterator[None]:
    """Use the report's settings instead of the user's."""
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rc_file(STYLE)
        yield


@contextmanager
def panels(
    path: Path, rows: int = 1, columns: int = 1, *, height: float = 3.0, **options: Any
) -> Iterator[list[Axes]]:
    """Draw a figure of panels, ``height`` inches high, with room for a legend above; write it to a file."""
    from matplotlib.figure import Figure

    with style():
        figure = Figure(layout="constrained")
        figure.set_figheight(height)
        yield list(figure.subplots(rows, columns, squeeze=False, **options).flat)
        write_svg(figure, path)


def legend_above(axes: Axes, columns: int = 4) -> None:
    """Place the legend of a panel above its figure."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    place: dict[str, Any] = {"loc": "outside upper left", "ncols": columns, "borderaxespad": 0.4}
    figure.legend(*axes.get_legend_handles_labels(), **place)


def name_curves(legend: Legend, names: Sequence[str]) -> None:
    """Write plain names into a legend: in a label "$x" is mathematics, and "_x" does not appear."""
    for text, name in zip(legend.get_texts(), names, strict=True):
        text.set_parse_math(False)
        text.set_text(name)


def inline_svg(figure: Figure, key: str) -> str:
    """Return a figure made inside `style` as an ``<svg>`` element, the same text for the same data.

    ``key``, unique on the page, tells its ids from another figure's, which matplotlib numbers alike.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    text = StringIO()
    with mpl.rc_context({"svg.hashsalt": key}):  # `Figure.savefig` would draw it twice
        canvas = FigureCanvasSVG(figure)
        metadata = dict.fromkeys(("Creator", "Date", "Format", "Type"))
        canvas.print_svg(text, metadata=metadata)  # type: ignore[no-untyped-call]
    svg = re.sub(r"<\?xml.*?\?>|<!DOCTYPE.*?>|<!--.*?-->", "", text.getvalue(), flags=re.DOTALL)
    svg = re.sub(r'<g id="[^"]*"', "<g", svg)  # matplotlib numbers them alike in every figure
    # A hundredth of a point is invisible; texts between tags stay whole.
    svg = re.sub(r"<[^>]*>", lambda tag: re.sub(r"(\.\d\d)\d+", r"\1", tag[0]), svg)
    for role, colour in _ROLES.items():
        if colour in _IN_FIGURES and role != "difference":  # it has the colour of the ink
            svg = svg.replace(colour, f"var(--{role})")
    return re.sub(r'<svg [^>]*(viewBox="[^"]*")[^>]*>', r'<svg \1 focusable="false">', svg, count=1).strip()


def standalone(svg: str) -> str:
    """Return an inline figure as a file on white, with colours for the variables that only browsers know."""
    head = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
    text = str(svg).replace("<svg ", f'{head}style="background:#fff" ', 1) + "\n"
    return re.sub(r"var\(--([\w-]+)\)", lambda match: _ROLES[match[1]], text)


def write_svg(figure: Figure, path: Path) -> None:
    """Write a figure, created inside `style`, to a file."""
    write_text(standalone(inline_svg(figure, path.stem)), path)


def envelope(values: Array, columns: int = COLUMNS) -> NDArray[np.intp]:
    """Return the indices of the first smallest and first largest sample of each column, and both ends.

    With at most two samples a column it has all indices. Plain decimation would drop forces of one sample.
    """
    n = len(values)
    if n <= 2 * columns:
        return np.arange(n)
    indices = [0, n - 1]
    for start, block in _blocks(values, columns):
        indices += [start + int(np.argmin(block)), start + int(np.argmax(block))]
    return np.unique(indices)


def upper_envelope(values: Array, columns: int = COLUMNS) -> NDArray[np.intp]:
    """Return the index of the largest sample of each column, increasing; for magnitudes on a log axis."""
    if len(values) <= columns:
        return np.arange(len(values))
    return np.array([start + int(np.argmax(block)) for start, block in _blocks(values, columns)])


def _blocks(values: Array, columns: int) -> Iterator[tuple[int, Array]]:
    for start, stop in pairwise(((np.arange(columns + 1) * len(values)) // columns).tolist()):
        yield start, values[start:stop]


def spans(mask: BoolArray, time: Array, columns: int = COLUMNS) -> list[tuple[float, float]]:
    """Return the disjoint time intervals in which the mask is true, for shading.

    Each sample stands for the time half-way to its neighbours. An interval narrower than a column gets its
    width, to be visible; intervals that then touch are merged.
    """
    if not mask.any():
        return []
    middle = (time[1:] + time[:-1]) / 2
    left, right = np.append(time[0], middle), np.append(middle, time[-1])
    change = np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8))
    first, last = np.flatnonzero(change == 1), np.flatnonzero(change == -1) - 1
    width = (time[-1] - time[0]) / columns
    intervals: list[tuple[float, float]] = []
    for start, end in zip(left[first], right[last], strict=True):
        gap = max(0.0, width - (end - start)) / 2
        low, high = max(time[0], start - gap), min(time[-1], end + gap)
        if intervals and low <= intervals[-1][1]:
            intervals[-1] = (intervals[-1][0], high)
        else:
            intervals.append((float(low), float(high)))
    return intervals
