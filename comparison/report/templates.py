"""What all pages share: jinja's settings, style sheet and script, and where a page comes from."""

import base64
import hashlib
import subprocess
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from comparison.formatting import number, percent, quantity
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
TEMPLATES.globals |= {"symbols": SYMBOLS, "number": number, "percent": percent, "quantity": quantity}


def style() -> Markup:
    """Return the style sheet of all pages."""
    return Markup((ASSETS / "report.css").read_text("utf-8"))


def interactive_page(template: str, **values: Any) -> str:
    """Return a page with the script of the interactive plots, and nothing else that may run."""
    names = ("uplot/LICENSE", "uplot/uPlot.iife.min.js", "animation.js", "plots.js", "uplot/uPlot.min.css")
    licence, library, animation, plots, css = ((ASSETS / name).read_text("utf-8") for name in names)
    script = "\n".join([f"/* uPlot\n{licence}*/", library, animation, plots])
    return TEMPLATES.get_template(template).render(
        css=Markup(css + "\n") + style(),
        script=Markup(script),
        # The page's Content-Security-Policy admits the script by its hash.
        script_hash=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
        **values,
    )


def origin() -> dict[str, str]:
    """Return when, from what and where a report is made now."""
    made = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    return {"time": made, "code": code_version(Path(__file__)), "machine": platform_name()}


def code_version(file: Path) -> str:
    """Return version and, where this file is tracked in a checkout, the commit; "modified" if it differs."""
    try:
        release = f"sixbar-crossval {version('sixbar-crossval')}"
    except PackageNotFoundError:
        release = "sixbar-crossval"

    def git(*arguments: str) -> str:
        command = ["git", "-C", str(file.parent), *arguments]
        return subprocess.run(command, capture_output=True, text=True, timeout=10, check=True).stdout.strip()

    try:
        # An installed package may lie inside another project's checkout, whose commit says nothing about it.
        git("ls-files", "--error-unmatch", file.name)
        commit = git("rev-parse", "--short=10", "HEAD")
        changed = git("status", "--porcelain", "--untracked-files=no", ":/")
    except (OSError, subprocess.SubprocessError):  # there is no git, or it fails
        return release
    return f"{release}, commit {commit}{' with modifications' if changed else ''}"
