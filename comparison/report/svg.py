"""Figures of matplotlib as SVG in the colours of a page, and curves thinned to what a figure can show."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import StringIO
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from numpy.typing import NDArray

from comparison.files import replacing
from comparison.tables.arrays import Array, BoolArray

STYLE = Path(__file__).with_name("assets") / "sixbar.mplstyle"

HEIGHT = 3.0
"""Inches, of a figure with one panel."""
COLUMNS = 400
"""Columns of a figure: about its width in points."""
# Roles of the colours; the page's style sheet defines them for light and dark mode.
INK, GRID, FIRST, SECOND = "#111111", "#222222", "#333333", "#444444"
DIFFERENCE, THRESHOLD, SHADE, OUTSIDE, LIMIT = "#555555", "#666666", "#777777", "#888888", "#999999"
SERIES = ("#a01010", "#a02020", "#a03030", "#a04040", "#a05050", "#a06060")
"""Colours of anything but models (scenes, laws, classes), as many as can be distinguished."""
_VARIABLES = {
    INK: "--ink",
    GRID: "--grid",
    FIRST: "--first",
    SECOND: "--second",
    DIFFERENCE: "--difference",
    THRESHOLD: "--threshold",
    SHADE: "--shade",
    OUTSIDE: "--outside",
    LIMIT: "--limit",
} | {colour: f"--series-{n}" for n, colour in enumerate(SERIES, 1)}
_PREAMBLE = re.compile(r"<\?xml.*?\?>|<!DOCTYPE.*?>|<!--.*?-->|(?<=>)\s+(?=<)", re.DOTALL)
_ROLE = re.compile("|".join(_VARIABLES))
MODEL_LINES: tuple[dict[str, Any], ...] = (
    {"color": FIRST, "lw": 3.6, "alpha": 0.5},
    {"color": SECOND, "lw": 1.2},
)
"""Curves of the first and the second model over each other: a thin line on a wide one shows both where they
coincide, which dashes on a solid line of another colour do not: they look grey."""
SERIES_LINES: tuple[dict[str, Any], ...] = tuple(
    {"color": colour, "lw": width}
    for colour, width in zip(SERIES, (2.4, 1.9, 1.5, 1.1, 0.9, 0.8), strict=True)
)
"""Curves of anything but models over each other; those drawn first are the widest, and stay visible."""


# ---- figures


@contextmanager
def style(colours: Mapping[str, str] | None = None) -> Iterator[None]:
    """Use the report's settings instead of the user's matplotlibrc; settings are restored on exit.

    Parameters
    ----------
    colours
        Role -> colour, for a picture that is not put into a page.
    """
    with mpl.rc_context():
        mpl.rc_file(STYLE)
        if colours:
            for key, value in mpl.rcParams.items():
                mpl.rcParams[key] = colours.get(value, value) if isinstance(value, str) else value
        yield


def light_colours() -> dict[str, str]:
    """Return the colours of the roles on a light page, ``#rrggbb`` each."""
    # The first rule of the style sheet is that of the light page.
    css, _, _ = STYLE.with_name("report.css").read_text("utf-8").partition("}")
    defined: dict[str, str] = dict(re.findall(r"(--[\w-]+): (#[0-9a-f]{6})", css))
    return {role: defined[variable] for role, variable in _VARIABLES.items()}


@contextmanager
def panels(
    path: Path, rows: int = 1, columns: int = 1, *, height: float = HEIGHT, **options: Any
) -> Iterator[list[Axes]]:
    """Draw a figure of panels and write it to a file.

    Parameters
    ----------
    path
        Where to.
    rows, columns
        Of panels.
    height
        Inches; the width is that of the style.
    options
        Of `matplotlib.figure.Figure.subplots`, such as ``sharex``.

    Yields
    ------
    axes
        Row by row. Room is left for a legend above them (`legend_above`).
    """
    with style():
        figure = Figure(layout="constrained")
        figure.set_figheight(height)
        axes = list(figure.subplots(rows, columns, squeeze=False, **options).flat)
        yield axes
        write_svg(figure, path)


def legend_above(axes: Axes, columns: int = 4) -> None:
    """Place the legend of a panel above its figure."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    figure.legend(
        *axes.get_legend_handles_labels(), loc="outside upper left", ncols=columns, borderaxespad=0.4
    )


def name_curves(legend: Legend, names: Sequence[str]) -> None:
    """Write names into a legend as they are: to a label "$x" is mathematics, and "_x" not in a legend."""
    for text, name in zip(legend.get_texts(), names, strict=True):
        text.set_parse_math(False)
        text.set_text(name)


# ---- SVG


def inline_svg(figure: Figure, key: str) -> str:
    """Return the figure as an ``<svg>`` element in the colours of the page that it is put into.

    Parameters
    ----------
    figure
        Created inside `style`, drawn with the colours of this module.
    key
        Unique on the page: salt of the ids, since matplotlib numbers the parts of every figure alike, and two
        figures on one page would use each other's.

    Returns
    -------
    svg
        Reproducible text: no date, no random ids.
    """
    text = StringIO()
    with mpl.rc_context({"svg.hashsalt": key}):
        figure.savefig(text, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
    svg = re.sub(
        r"<\?xml.*?\?>|<!DOCTYPE.*?>|<!--.*?-->|(?<=>)\s+(?=<)", "", text.getvalue(), flags=re.DOTALL
    )
    # Nothing refers to a group, and most carry no style either.
    svg = re.sub(r'<g id="[^"]*"', "<g", svg)
    if "<g " not in svg:
        svg = re.sub(r"</?g>", "", svg)
    # Hundredths of a point are finer than a screen.
    svg = re.sub(r"<[^<>]*>", lambda tag: re.sub(r"\d+\.\d{3,}", _hundredths, tag[0]), svg)
    svg = _ROLE.sub(lambda role: f"var({_VARIABLES[role[0]]})", svg)
    return re.sub(r'<svg [^>]*(viewBox="[^"]*")[^>]*>', r'<svg \1 focusable="false">', svg, count=1).strip()


def _hundredths(number: re.Match[str]) -> str:
    return f"{float(number[0]):.2f}"


def standalone(svg: str) -> str:
    """Return an inline figure as a standalone file on white, with the colours of the light page.

    Written out, since programs other than browsers draw nothing in the colour of a variable.
    """
    head = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
    text = str(svg).replace("<svg ", f'{head}style="background:#fff" ', 1) + "\n"
    for role, colour in light_colours().items():
        text = text.replace(f"var({_VARIABLES[role]})", colour)
    return text


def write_svg(figure: Figure, path: Path) -> None:
    """Write a figure, created inside `style`, to a file."""
    with replacing(path) as part:
        part.write_text(standalone(inline_svg(figure, path.stem)), "utf-8")


# ---- curves


def envelope(values: Array, columns: int = COLUMNS) -> NDArray[np.intp]:
    """Return the indices of the samples of the lower and upper envelope.

    Plain decimation would drop contact forces that last for a single sample.

    Parameters
    ----------
    values
        Samples in order of time, shape (n,).
    columns
        Number of columns, with equal numbers of samples.

    Returns
    -------
    indices
        Strictly increasing; the first smallest and the first largest sample of each column, and the first and
        the last sample of all. All samples if there are at most two per column.
    """
    n = len(values)
    if n <= 2 * columns:
        return np.arange(n)
    kept = {0, n - 1}
    for start, block in _blocks(values, columns):
        kept.update((start + int(np.argmin(block)), start + int(np.argmax(block))))
    return np.array(sorted(kept))


def upper_envelope(values: Array, columns: int = COLUMNS) -> NDArray[np.intp]:
    """Return the index of the largest sample of each column, increasing; for magnitudes on a log axis."""
    if len(values) <= columns:
        return np.arange(len(values))
    return np.array([start + int(np.argmax(block)) for start, block in _blocks(values, columns)])


def _blocks(values: Array, columns: int) -> Iterator[tuple[int, Array]]:
    """Yield (index of the first sample, samples) of each column."""
    edges = (np.arange(columns + 1) * len(values)) // columns
    for start, stop in pairwise(edges.tolist()):
        yield start, values[start:stop]


def spans(mask: BoolArray, time: Array, columns: int = COLUMNS) -> list[tuple[float, float]]:
    """Return the time intervals in which the mask holds, for shading.

    Each sample represents the time half-way to its neighbours. An interval narrower than a column is widened
    to one to remain visible; intervals that then touch are merged.

    Parameters
    ----------
    mask, time
        Shape (n,), time increasing.
    columns
        Columns of the figure, which spans the time.

    Returns
    -------
    stretches
        (start, end) in the unit of time, increasing, disjoint and inside the span.
    """
    if not mask.any():
        return []
    middle = (time[1:] + time[:-1]) / 2
    left, right = np.append(time[0], middle), np.append(middle, time[-1])
    change = np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8))
    first, last = np.flatnonzero(change == 1), np.flatnonzero(change == -1) - 1
    least = (time[-1] - time[0]) / columns
    joined: list[tuple[float, float]] = []
    for start, end in zip(left[first], right[last], strict=True):
        missing = max(0.0, least - (end - start)) / 2
        low, high = max(time[0], start - missing), min(time[-1], end + missing)
        if joined and low <= joined[-1][1]:
            joined[-1] = (joined[-1][0], high)
        else:
            joined.append((float(low), float(high)))
    return joined
