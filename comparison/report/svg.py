"""Conversion of matplotlib figures to inline SVG: unique ids, colours of the page, small size."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import StringIO
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend import Legend

from comparison.files import replacing

STYLE = Path(__file__).with_name("assets") / "sixbar.mplstyle"

HEIGHT = 3.0
"""Inches, of a figure with one panel."""
# Roles of the colours; the page's style sheet defines them for light and dark mode.
INK, GRID, FIRST, SECOND = "#111111", "#222222", "#333333", "#444444"
DIFFERENCE, THRESHOLD, SHADE, OUTSIDE, LIMIT = "#555555", "#666666", "#777777", "#888888", "#999999"
_ROLES = {
    INK: "currentColor",
    GRID: "var(--grid)",
    FIRST: "var(--first)",
    SECOND: "var(--second)",
    DIFFERENCE: "var(--difference)",
    THRESHOLD: "var(--threshold)",
    SHADE: "var(--shade)",
    OUTSIDE: "var(--outside)",
    LIMIT: "var(--limit)",
}
MODEL_LINES: tuple[dict[str, Any], ...] = (
    {"color": FIRST, "lw": 3.6, "alpha": 0.5},
    {"color": SECOND, "lw": 1.2},
)
"""Curves of the first and the second model over each other: a thin line on a wide one shows both where they
coincide, which dashes on a solid line of another colour do not: they look grey."""
SERIES = ("#a01010", "#a02020", "#a03030", "#a04040", "#a05050", "#a06060")
"""Colours of anything but models (scenes, laws, classes), as many as can be distinguished."""
SERIES_LINES: tuple[dict[str, Any], ...] = tuple(
    {"color": colour, "lw": width}
    for colour, width in zip(SERIES, (2.4, 1.9, 1.5, 1.1, 0.9, 0.8), strict=True)
)
"""Curves of anything but models over each other; those drawn first are the widest, and stay visible."""
_ROLES |= {colour: f"var(--series-{n})" for n, colour in enumerate(SERIES, 1)}
_COLOUR = re.compile("|".join(_ROLES))
_PATH = re.compile(r'(?<= )d="([^"]*)"')
_NUMBER = re.compile(r"-?\d+\.\d+")
_BLANKS = re.compile(r"\s*([MLQCz])\s*")
_PREAMBLE = re.compile(r"<\?xml.*?\?>|<!DOCTYPE.*?>|<!--.*?-->", re.DOTALL)
_ID = re.compile(r' id="([^"]*)"')
_REFERENCE = re.compile(r"(url\(#|href=\"#)([^\")]*)")


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
    return {role: defined.get(name[4:-1], defined["--ink"]) for role, name in _ROLES.items()}


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


def _rounded(match: re.Match[str]) -> str:
    """Return a path with absolute coordinates in tenths of a point, without redundant blanks."""
    path = _NUMBER.sub(
        lambda m: f"{float(m.group()):.1f}".removesuffix(".0").replace("-0.", "-."), match.group(1)
    )
    return 'd="' + _BLANKS.sub(r"\1", path).strip() + '"'


def standalone(svg: str) -> str:
    """Return an inline figure as a standalone file on white, with the colours of the light page.

    Written out, since programs other than browsers draw nothing in the colour of a variable.
    """
    head = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
    text = str(svg).replace("<svg ", f'{head}style="background:#fff" ', 1) + "\n"
    for role, colour in light_colours().items():
        text = text.replace(_ROLES[role], colour)
    return text


def inline_svg(figure: Figure, key: str) -> str:
    """Return the figure as an ``<svg>`` element to be put into an HTML page.

    Parameters
    ----------
    figure
        Created inside `style`, drawn with the colours of this module.
    key
        Unique on the page, letters, digits and hyphens; prefix of every id. Matplotlib numbers the parts of
        every figure alike and clip paths of equal rectangles get equal ids, so two figures on one page would
        otherwise use each other's.

    Returns
    -------
    svg
        Reproducible text: no date, no random ids.
    """
    text = StringIO()
    figure.savefig(text, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
    svg = _PREAMBLE.sub("", text.getvalue())
    used = {name: f"{key}-{n}" for n, name in enumerate(dict.fromkeys(m[1] for m in _REFERENCE.findall(svg)))}
    svg = _ID.sub(lambda m: f' id="{used[m.group(1)]}"' if m.group(1) in used else "", svg)
    svg = _REFERENCE.sub(lambda m: m.group(1) + used[m.group(2)], svg)
    svg = _COLOUR.sub(lambda m: _ROLES[m.group()], svg)
    svg = _PATH.sub(_rounded, svg)
    svg = re.sub(r'<svg [^>]*viewBox="([^"]*)"[^>]*>', r'<svg viewBox="\1" focusable="false">', svg, count=1)
    return re.sub(r">\s+<", "><", svg).strip()


def write_svg(figure: Figure, path: Path) -> None:
    """Write a figure, created inside `style`, to a file."""
    with replacing(path) as part:
        part.write_text(standalone(inline_svg(figure, path.stem)), "utf-8")
