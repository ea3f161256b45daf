"""A study: what it is asked with, what it measures, the page that it fills and the figures that it draws."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, Generic, TypeVar

from jinja2 import Environment, StrictUndefined
from markdown_it import MarkdownIt
from markupsafe import Markup

from comparison.execution.run import Progress
from comparison.files import replacing_in, write_json, write_text
from comparison.formatting import number, percent, quantity
from comparison.report.page import TEMPLATES, style
from comparison.studies.shared.frames import markdown

C = TypeVar("C")
R = TypeVar("R")

# What is measured stands in the template of a page in braces: {runs.x.max() | number}.
_PAGES = Environment(
    variable_start_string="{",
    variable_end_string="}",
    trim_blocks=True,
    keep_trailing_newline=True,
    undefined=StrictUndefined,
)
_PAGES.filters |= {"number": number, "percent": percent, "quantity": quantity, "markdown": markdown}
_ONE_FILE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'">
<title>{{ title }}</title>
<style>{{ css }}</style>
</head>
<body>
<main>
{{ body }}
</main>
</body>
</html>
"""


@dataclass(frozen=True)
class Study(Generic[C, R]):
    """A study of this package."""

    name: str  # as the command line takes it; also of its package and template
    small: C
    full: C  # what it is asked with: to try it, or for its report
    measure: Callable[[C, int, Progress | None], R]
    """Runs and measures, with so many worker processes and progress from 0 to 1."""
    page: Callable[[R], Mapping[str, object]]
    """What the template asks for: tables, numbers and texts."""
    draw: Callable[[R, Path], None]
    """Writes figures and tables into a folder."""
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
        write_text(self.text(results), page)
        if self.one_file:
            write_text(single_page(page), folder / "report.html")
        return page

    def text(self, results: R) -> str:
        """Return the page: its template with what is measured."""
        name = self.name.replace("-", "_")
        template = files(f"comparison.studies.{name}") / f"{name}.md"
        return _PAGES.from_string(template.read_text("utf-8")).render(self.page(results))


def part(on_progress: Progress | None, start: float, end: float) -> Progress | None:
    """Return what reports the progress of a part, which takes the whole from one share to another."""
    return None if on_progress is None else lambda share: on_progress(start + (end - start) * share)


def single_page(readme: Path) -> str:
    """Return HTML with the text of a README, whose own HTML is shown as text, and the figures beside it.

    Links to figures and headings lead to their places on the page.
    """

    def heading(match: re.Match[str]) -> str:
        anchor = re.sub(r"[^\w-]", "", match[1].lower().replace(" ", "-"))
        return f'<h2 id="{anchor}">{match[1]}</h2>'

    def figure(match: re.Match[str]) -> str:
        name, caption = match.groups()  # Markdown has escaped it
        drawing = (readme.parent / f"{name}.svg").read_text("utf-8")
        return (
            f'<figure id="{name}"><div role="img" aria-label="{caption}">{drawing}</div>'
            f"<figcaption>{caption}</figcaption></figure>"
        )

    text = readme.read_text("utf-8")
    body = MarkdownIt("commonmark", {"html": False}).enable("table").render(text)
    body = body.replace("<table>", '<div class="scroll"><table>').replace("</table>", "</table></div>")
    body = re.sub(r"<h2>(.*?)</h2>", heading, body)
    body = re.sub(r'href="([\w-]+)\.svg"', r'href="#\1"', body)
    body = re.sub(r'<p><img src="([\w-]+)\.svg" alt="([^"]*)" ?/?></p>', figure, body)
    title = text.partition("\n")[0].removeprefix("# ")
    return TEMPLATES.from_string(_ONE_FILE).render(title=title, css=style(), body=Markup(body))
