"""A study: extent, measurement, page and figures; tables and rates of several pages."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, Generic, TypeVar

import pandas as pd
from jinja2 import Environment, StrictUndefined
from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, FormatStrFormatter, NullLocator
from scipy.stats import binomtest

from comparison.execution.run import Progress
from comparison.files import replacing, replacing_in, write_json, write_text
from comparison.formatting import MISSING, number, percent, quantity, table

C = TypeVar("C")
R = TypeVar("R")


@dataclass(frozen=True)
class Study(Generic[C, R]):
    """A study of this package."""

    name: str  # as the command line takes it; also of its template, and of its package or module
    small: C
    full: C  # its extent: for a trial, or for its report
    measure: Callable[[C, int, Progress | None], R]
    """Runs and measures, with so many worker processes and progress from 0 to 1."""
    page: Callable[[R], Mapping[str, object]]
    """Returns the tables, numbers and texts of the template."""
    draw: Callable[[R, Path], None]
    """Writes figures and tables into a folder."""
    data: Callable[[R], Mapping[str, Any]] | None = None
    """Returns the content of ``NAME.json`` beside the page; None: there is no such file."""
    part_of: str = ""
    """Study of which it is a part: its page is NAME.md there, all else in a folder NAME beside the page."""

    def write(self, folder: Path, n_jobs: int, on_progress: Progress | None, *, small: bool = False) -> Path:
        """Measure, and write page, data and figures into a folder; return the page's path."""
        results = self.measure(self.small if small else self.full, n_jobs, on_progress)
        with replacing_in(folder) as part:
            page = self.report(results, part)
        return folder / page.name

    def report(self, results: R, folder: Path) -> Path:
        """Write page, data and figures of results into a folder that is there; return the page's path."""
        assets = folder / self.name if self.part_of else folder
        assets.mkdir(exist_ok=True)
        self.draw(results, assets)
        if self.data is not None:
            write_json(self.data(results), assets / f"{self.name}.json")
        page = folder / (f"{self.name}.md" if self.part_of else "README.md")
        write_text(self.text(results), page)
        return page

    def text(self, results: R) -> str:
        """Return the page: its template with the results."""
        folder, name = files("comparison.studies"), self.name.replace("-", "_")
        path = folder / (self.part_of or name) / f"{name}.md"
        template = path if path.is_file() else folder / f"{name}.md"
        return _PAGES.from_string(template.read_text("utf-8")).render(self.page(results))


def part(on_progress: Progress | None, start: float, end: float) -> Progress | None:
    """Return the progress function of a part, from one share of the whole to another."""
    return None if on_progress is None else lambda share: on_progress(start + (end - start) * share)


# ---- tables

Columns = dict[Any, Callable[[Any], str]]  # a column of a frame, and the function that writes its values


def markdown(frame: pd.DataFrame, columns: Mapping[Any, Callable[[Any], str]] | None = None) -> str:
    """Return a frame as a table, by default all columns as text; values and whole columns may be missing."""
    writers: Columns = dict.fromkeys(frame, str) if columns is None else dict(columns)
    values = frame.reindex(columns=list(writers)).to_dict("list")
    cells = [
        [MISSING if pd.isna(value) else write(value) for value in values[name]]
        for name, write in writers.items()
    ]
    return table([str(name) for name in writers], zip(*cells, strict=True))


def rows_table(rows: Iterable[Mapping[str, str]]) -> str:
    """Return a table of rows with the same columns, heading -> cell; nothing where there is no row."""
    frame = pd.DataFrame(list(rows))
    return "" if frame.empty else markdown(frame)


def cross_table(heading: str, rows: Sequence[str], columns: Sequence[str], cells: Sequence[str]) -> str:
    """Return cells as a table over the names of their rows and columns, each in the order of the first."""
    frame = pd.DataFrame({heading: rows, "column": columns, "cell": cells})
    pivot = frame.pivot_table("cell", heading, "column", aggfunc="first", sort=False)
    return markdown(pivot.reset_index())


def write_csv(frames: Mapping[str, pd.DataFrame], folder: Path, digits: str | None = None) -> None:
    """Write frames to ``NAME.csv`` in a folder, their numbers as the format ``digits`` says."""
    for name, frame in frames.items():
        with replacing(folder / f"{name}.csv") as part:
            frame.to_csv(part, index=False, float_format=digits)


# Results stand in the template of a page in braces: {runs.x.max() | number}.
_PAGES = Environment(
    variable_start_string="{",
    variable_end_string="}",
    trim_blocks=True,
    keep_trailing_newline=True,
    undefined=StrictUndefined,
)
_PAGES.filters |= {"number": number, "percent": percent, "quantity": quantity, "markdown": markdown}


# ---- figures and rates


def plain_ticks(axis: Axis, ticks: Sequence[float]) -> None:
    """Label a logarithmic axis with plain numbers, those within its limits."""
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_major_formatter(FormatStrFormatter("%g"))
    axis.set_minor_locator(NullLocator())


def interval(count: int, trials: int) -> tuple[float, float]:
    """Return the two-sided 95 % interval of Clopper and Pearson of a rate; 0 to 1 without a trial."""
    if not trials:
        return 0.0, 1.0
    bounds = binomtest(count, trials).proportion_ci(0.95, method="exact")
    return float(bounds.low), float(bounds.high)


def upper_limit(count: int, trials: int) -> float:
    """Return the one-sided 95 % upper limit of Clopper and Pearson of a rate; 1 without a trial."""
    if not trials:
        return 1.0
    return float(binomtest(count, trials, alternative="less").proportion_ci(0.95, method="exact").high)


def share(rate: float) -> str:
    """Return a rate as percent with two digits."""
    return f"{100 * rate:.2g}\u00a0%" if rate < 0.995 else f"{100 * rate:.3g}\u00a0%"
