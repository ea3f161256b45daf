"""What the templates of all pages share: jinja's settings, the style sheet, the hash of a script."""

from __future__ import annotations

import base64
import hashlib
from pathlib import Path

import jinja2
from markupsafe import Markup

ASSETS = Path(__file__).with_name("assets")

TEMPLATES = jinja2.Environment(
    loader=jinja2.FileSystemLoader(ASSETS),
    autoescape=True,
    undefined=jinja2.StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)
"""HTML is escaped, and a name without a value is an error."""


def style() -> Markup:
    """Return the style sheet of all pages."""
    return Markup((ASSETS / "report.css").read_text("utf-8"))


def script_hash(script: str) -> str:
    """Return the hash by which a page's Content-Security-Policy admits its script."""
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
