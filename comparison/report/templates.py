"""What all pages share: jinja's settings, style sheet and script, and where a page comes from."""

from __future__ import annotations

import base64
import hashlib
import subprocess
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from comparison.files import replacing
from comparison.models import platform_name
from comparison.words.verdicts import SYMBOLS

ASSETS = Path(__file__).with_name("assets")
TEMPLATES = jinja2.Environment(
    loader=jinja2.FileSystemLoader(ASSETS),
    autoescape=True,
    undefined=jinja2.StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)
"""HTML is escaped, and a name without a value is an error."""
TEMPLATES.globals["symbols"] = SYMBOLS


def style() -> Markup:
    """Return the style sheet of all pages."""
    return Markup((ASSETS / "report.css").read_text("utf-8"))


def interactive_page(template: str, **values: Any) -> str:
    """Return a page with the script of the interactive plots, and nothing else that may run.

    Parameters
    ----------
    template
        File name in the assets, which extends ``base.html.j2``.
    values
        Of the template.
    """
    library = ASSETS / "uplot"
    script = "\n".join(
        [
            f"/* uPlot\n{(library / 'LICENSE').read_text('utf-8')}*/",
            (library / "uPlot.iife.min.js").read_text("utf-8"),
            (ASSETS / "animation.js").read_text("utf-8"),
            (ASSETS / "plots.js").read_text("utf-8"),
        ]
    )
    return TEMPLATES.get_template(template).render(
        css=Markup((library / "uPlot.min.css").read_text("utf-8") + "\n") + style(),
        script=Markup(script),
        # The page's Content-Security-Policy admits the script by its hash.
        script_hash=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
        **values,
    )


def write_page(html: str, path: Path) -> Path:
    """Write a page; its folder is made, and an existing file is replaced once the new one is complete."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as part:
        part.write_text(html, "utf-8")
    return path


@dataclass(frozen=True)
class Origin:
    """When, from what and where a report was made, one line each."""

    time: str
    code: str
    machine: str


def origin() -> Origin:
    """Return the origin of a report that is made now."""
    return Origin(
        time=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        code=code_version(Path(__file__)),
        machine=platform_name(),
    )


def code_version(file: Path) -> str:
    """Return version and, where this file is tracked in a checkout, the commit; "modified" if it differs."""
    try:
        release = f"sixbar-crossval {version('sixbar-crossval')}"
    except PackageNotFoundError:
        release = "sixbar-crossval"
    # An installed package may lie inside another project's checkout, whose commit says nothing about it.
    if _git(file, "ls-files", "--error-unmatch", file.name) is None:
        return release
    commit = _git(file, "rev-parse", "--short=10", "HEAD")
    if not commit:
        return release
    changed = _git(file, "status", "--porcelain", "--untracked-files=no", ":/")
    return f"{release}, commit {commit}{' with modifications' if changed else ''}"


def _git(file: Path, *arguments: str) -> str | None:
    """Return git's answer in the file's folder; None where there is no git, or it fails."""
    try:
        ran = subprocess.run(
            ["git", "-C", str(file.parent), *arguments],
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return ran.stdout.strip()
