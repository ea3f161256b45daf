"""The documents as a site: Sphinx with MyST and Furo; `generated` makes what follows from the code."""

from __future__ import annotations

import sys
from pathlib import Path

from latex2mathml.converter import convert

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "docs")]

import generated  # noqa: E402  (beside this file)
from docutils import nodes  # noqa: E402

project = "sixbar-crossval"
root_doc = "docs/index"
# The whole repository is the source, so that links between its pages hold here as they do beside the code.
include_patterns = ["*.md", "docs/**", "reports/README.md", "reports/*/*.md", "examples/*/README.md"]
exclude_patterns = [".*", "build", "reports/out", "**/__pycache__"]
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
source_suffix = {".md": "markdown", ".ipynb": "markdown"}
myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 4
autodoc_member_order = "bysource"
autodoc_typehints = "description"
html_theme = "furo"
html_title = "sixbar-crossval"
html_show_copyright = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
# MathML, which browsers draw by themselves: neither a script nor a font from a network.
html_math_renderer = "mathml"


def _inline(writer, node):
    writer.body.append(convert(node.astext()))
    raise nodes.SkipNode


def _block(writer, node):
    writer.body.append(f'<div class="formula">{convert(node.astext(), display="block")}</div>')
    raise nodes.SkipNode


def setup(app):
    """Register the formulas, the notebook and the generated ends of pages."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.connect("source-read", generated.append)
