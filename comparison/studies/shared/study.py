"""A study: what it is asked with, what it measures, the page that it fills and the figures that it draws."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, Generic, TypeVar

from comparison.execution.run import Progress
from comparison.files import replacing, replacing_in, write_json
from comparison.studies.shared.page import filled, single_page

C = TypeVar("C")
R = TypeVar("R")


@dataclass(frozen=True)
class Study(Generic[C, R]):
    """A study of this package."""

    name: str
    """As the command line takes it; also of its package and template. A part, which is a section of its page,
    has a dotted name."""
    small: C
    full: C
    """What it is asked with: to try it, or for its report."""
    measure: Callable[[C, int, Progress | None], R]
    """Runs and measures, with so many worker processes and progress from 0 to 1."""
    page: Callable[[R], Mapping[str, object]]
    """What the template asks for tables, numbers and texts (`comparison.studies.shared.page.filled`)."""
    draw: Callable[[R, Path], None]
    """Writes the figures into a folder."""
    data: Callable[[R], Mapping[str, Any]] | None = None
    """What goes into ``NAME.json`` beside the page; None: nothing."""
    one_file: bool = False
    """Whether page and figures go into one file too, ``report.html``."""

    def write(self, folder: Path, n_jobs: int, on_progress: Progress | None, *, small: bool = False) -> Path:
        """Measure, and write page, data and figures into a folder; return the page's path."""
        results = self.measure(self.small if small else self.full, n_jobs, on_progress)
        with replacing_in(folder) as part:
            page = self.report(results, part)
        return folder / page.name

    def report(self, results: R, folder: Path) -> Path:
        """Write page, data and figures of results into a folder that is there; return the page's path."""
        self.draw(results, folder)
        if self.data is not None:
            write_json(self.data(results), folder / f"{self.name}.json")
        page = folder / "README.md"
        with replacing(page) as part:
            part.write_text(self.text(results), "utf-8")
        if self.one_file:
            single_page(page, folder / "report.html")
        return page

    def text(self, results: R) -> str:
        """Return the page, or the section of one, with what is measured."""
        return filled(self.template(), self.page(results))

    def template(self) -> str:
        """Return the text of the page, with ``{expression}`` for what is measured."""
        name = self.name.replace("-", "_")
        return (
            files(f"comparison.studies.{name}").joinpath(f"{name.rpartition('.')[2]}.md").read_text("utf-8")
        )


def part(on_progress: Progress | None, start: float, end: float) -> Progress | None:
    """Return what reports the progress of a part, which takes the whole from one share to another."""
    return None if on_progress is None else lambda share: on_progress(start + (end - start) * share)
