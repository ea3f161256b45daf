"""A study's README from its template, and as one HTML file with its figures."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from jinja2 import Environment, StrictUndefined
from markdown_it import MarkdownIt
from markupsafe import Markup

from comparison.files import replacing
from comparison.formatting import number, percent, quantity
from comparison.report.templates import TEMPLATES, style
from comparison.studies.shared.frames import markdown

_PAGES = Environment(
    variable_start_string="{",
    variable_end_string="}",
    trim_blocks=True,
    keep_trailing_newline=True,
    undefined=StrictUndefined,
)
_PAGES.filters |= {"number": number, "percent": percent, "quantity": quantity, "markdown": markdown}
_PICTURE = re.compile(r'<p><img src="([\w-]+\.svg)" alt="([^"]*)" ?/?></p>')
_TO_PICTURE = re.compile(r'href="([\w-]+)\.svg"')
_HEADING = re.compile(r"<h2>(.*?)</h2>")
_PAGE = """<!DOCTYPE html>
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


def filled(template: str, values: Mapping[str, object]) -> str:
    """Return a page: jinja2, with an expression in braces for what is measured, ``{runs.x.max() | number}``.

    Parameters
    ----------
    template
        Its filters are those of `comparison.formatting`, and ``markdown`` for a data frame.
    values
        Tables, numbers and texts by the names that the template uses.
    """
    return _PAGES.from_string(template).render(values)


def single_page(readme: Path, page: Path) -> None:
    """Write a page with the text of a README and the SVG files that it shows beside it.

    Links to figures and headings lead to their places on the page. HTML in the README is shown as text. A
    figure carries its own colours, so that it looks as in its file.
    """
    text = readme.read_text("utf-8")
    body = MarkdownIt("commonmark", {"html": False}).enable("table").render(text)
    body = body.replace("<table>", '<div class="scroll"><table>').replace("</table>", "</table></div>")
    body = _HEADING.sub(lambda match: f'<h2 id="{_anchor(match[1])}">{match[1]}</h2>', body)
    body = _TO_PICTURE.sub(r'href="#\1"', body)
    body = _PICTURE.sub(lambda match: _figure(readme.parent / match[1], match[2]), body)
    html = TEMPLATES.from_string(_PAGE).render(
        title=text.partition("\n")[0].removeprefix("# "),
        css=style(),
        body=Markup(body),
    )
    with replacing(page) as part:
        part.write_text(html, "utf-8")


def _anchor(heading: str) -> str:
    """Return the name by which a README's links find a heading."""
    return re.sub(r"[^\w-]", "", heading.lower().replace(" ", "-"))


def _figure(path: Path, caption: str) -> str:
    """Return a picture with its caption, which Markdown has escaped already."""
    drawing = path.read_text("utf-8")
    return (
        f'<figure id="{path.stem}"><div role="img" aria-label="{caption}">{drawing}</div>'
        f"<figcaption>{caption}</figcaption></figure>"
    )
