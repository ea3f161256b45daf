"""One picture of chosen channels over time, of one table or of two over each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from comparison.files import replacing
from comparison.formatting import prefix
from comparison.report import svg
from comparison.tables.arrays import Array
from comparison.tables.channels import UNCERTAINTY, Channel
from comparison.tables.channels import channels as all_channels
from comparison.tables.table import Table, TableError

FORMATS = (".svg", ".png", ".pdf")
_PANEL = 1.35  # inches of height
_COLUMNS = 1200  # of a curve: enough for a picture that is enlarged three times
_SHADED = 0.25  # opacity of a curve's estimated error


class Picture(Figure):
    """A figure that notebooks show."""

    def _repr_svg_(self) -> str:
        text = StringIO()
        self.savefig(text, format="svg")
        return text.getvalue()


def picture(
    tables: Mapping[str, Table],
    names: Sequence[str] = ("slider_x",),
    *,
    start: float | None = None,
    end: float | None = None,
    colours: Mapping[str, str] | None = None,
) -> Picture:
    """Draw channels of one table or two over time, a panel each; an estimated error is shaded.

    Parameters
    ----------
    tables
        Label -> table, at most two.
    names
        Channels, or columns that are none.
    start, end
        Of the time shown, s; default: that of the tables.
    colours
        Of the roles in `comparison.report.svg`; default: those of a light page.

    Raises
    ------
    TableError
        If a table lacks a channel, or has no two samples between start and end.
    """
    shown = svg.light_colours() if colours is None else colours
    parts = {label: _between(table, label, start, end) for label, table in tables.items()}
    with svg.style(shown):
        figure = Picture(layout="constrained")
        figure.set_figheight(max(2.2, _PANEL * len(names) + 0.8))
        axes = list(figure.subplots(len(names), 1, sharex=True, squeeze=False).flat)
        for panel, name in zip(axes, names, strict=True):
            curves = {label: _values(tables[label], name, label)[kept] for label, (_, kept) in parts.items()}
            errors = {
                label: tables[label].values(name + UNCERTAINTY)[kept]
                for label, (_, kept) in parts.items()
                if name + UNCERTAINTY in tables[label].frame
            }
            times = {label: time for label, (time, _) in parts.items()}
            _draw(panel, name, times, curves, errors, tables, shown)
        axes[-1].set_xlabel("time (s)")
        figure.align_ylabels(axes)
        if len(tables) > 1:
            svg.legend_above(axes[0])
            svg.name_curves(figure.legends[0], list(tables))
    return figure


def write_picture(
    tables: Mapping[str, Table], names: Sequence[str], path: Path, *, start: float | None, end: float | None
) -> Path:
    """Draw channels into a file, by its ending SVG, PNG or PDF; see `picture`.

    An SVG has real text, and follows the colours of a page that includes it.
    """
    check_format(path)
    vector = path.suffix.lower() == ".svg"
    figure = picture(tables, names, start=start, end=end, colours={} if vector else None)
    path.parent.mkdir(parents=True, exist_ok=True)
    if vector:
        with svg.style():
            svg.write_svg(figure, path)
        return path
    with replacing(path) as part, mpl.rc_context({"savefig.facecolor": "white"}):
        figure.savefig(part, format=path.suffix[1:].lower(), dpi=200, facecolor="white")
    return path


def check_format(path: Path) -> None:
    """Reject a file name with an unknown extension.

    Raises
    ------
    TableError
        If it is none of `FORMATS`.
    """
    if path.suffix.lower() not in FORMATS:
        raise TableError(f"{path}: the name must end in {', '.join(FORMATS[:-1])} or {FORMATS[-1]}")


def _between(table: Table, label: str, start: float | None, end: float | None) -> tuple[Array, Any]:
    """Return the times shown and which samples they are."""
    time = table.time
    kept = np.ones(time.shape, dtype=np.bool_)
    if start is not None:
        kept &= time >= start
    if end is not None:
        kept &= time <= end
    if kept.sum() < 2:
        low, high = (f"{edge:g}" for edge in (time.min(initial=np.inf), time.max(initial=-np.inf)))
        raise TableError(f"{label}: fewer than two samples are shown; its time is {low} s to {high} s")
    return time[kept], kept


def _values(table: Table, name: str, label: str) -> Array:
    if name not in table.frame:
        raise TableError(f"{label}: channel {name!r} is missing; it has {', '.join(table.channels)}")
    return table.values(name)


def _draw(
    panel: Any,
    name: str,
    times: Mapping[str, Array],
    curves: Mapping[str, Array],
    errors: Mapping[str, Array],
    tables: Mapping[str, Table],
    colours: Mapping[str, str],
) -> None:
    known = all_channels().get(name.removesuffix(UNCERTAINTY))
    title = known.label if known else name
    if known and known.name != name:
        title = f"estimated error of {title}"
    guide = _guide(next(iter(tables.values()))) if name == "slider_x" else None
    if guide is not None:
        curves, title = {label: values - guide for label, values in curves.items()}, "slider x − guide"
    factor, unit = prefix(max(float(np.nanmax(np.abs(values))) for values in curves.values()), _unit(known))
    for number, ((label, values), line) in enumerate(zip(curves.items(), svg.MODEL_LINES, strict=False)):
        own = line | {"color": colours.get(str(line["color"]), line["color"])}
        kept = svg.envelope(values, _COLUMNS)
        panel.plot(times[label][kept], values[kept] / factor, label=f"table {number}", **own)
        if (u := errors.get(label)) is not None:
            low, high = ((values + sign * u) / factor for sign in (-1.0, 1.0))
            kept = np.union1d(svg.envelope(low, _COLUMNS), svg.envelope(high, _COLUMNS))
            panel.fill_between(
                times[label][kept], low[kept], high[kept], color=own["color"], alpha=_SHADED, lw=0
            )
    title = title.replace(", ", ",\n")
    panel.set_ylabel(f"{title}\n({unit})" if unit else title, parse_math=False)
    panel.margins(y=0.06)


def _guide(table: Table) -> float | None:
    """Return the x of the guide's centre line, m: a clearance is invisible on an axis of half a metre."""
    scene = table.provenance.get("scene")
    try:
        return float(scene["mechanism"]["guide_x"]) if scene else None
    except (KeyError, TypeError, ValueError):
        return None


def _unit(known: Channel | None) -> str:
    return known.unit if known else ""
