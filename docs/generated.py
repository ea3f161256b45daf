"""What is made while the site is built: commands, keys, names of `sixbar`, results of the notebook."""

from __future__ import annotations

import ast
import io
import json
from collections.abc import Iterator
from contextlib import redirect_stdout
from typing import Any

import typer

WIDTH = 88
"""Columns of the commands' help."""


def commands() -> str:
    """Return the help of every command as Markdown."""
    from comparison.cli.main import app

    return "\n\n".join(_help("sixbar", typer.main.get_command(app), None))


def _help(name: str, command: Any, parent: Any) -> Iterator[str]:
    context = command.context_class(command, info_name=name, parent=parent, terminal_width=WIDTH)
    path = context.command_path
    yield f"## `{path}`\n\n```text\n{command.get_help(context)}\n```"
    for below, each in getattr(command, "commands", {}).items():
        if not each.hidden:
            yield from _help(below, each, context)


def keys() -> str:
    """Return a table of the keys of every section of a scene as Markdown."""
    from comparison.scene.keys import scene_keys

    lines, section = [], None
    for key in scene_keys():
        if section != (section := key.name.partition(".")[0]):
            lines += ["", f"## `{section.removesuffix('[]')}`", ""]
            lines += ["| key | unit | bounds | default | source | description |", "|---|---|---|---|---|---|"]
        default = "" if key.default is None else f"`{json.dumps(key.default)}`"
        cells = (f"`{key.name}`", key.unit, key.bounds, default, key.source, key.description)
        lines.append(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |")
    return "\n".join(lines)


def names() -> str:
    """Return a directive for the docstring of every name of `sixbar` as Markdown."""
    import sixbar

    made = [f"## {name}\n\n```{{eval-rst}}\n.. autofunction:: sixbar.{name}\n```" for name in sixbar.__all__]
    return "\n\n".join(made)


def notebook(text: str) -> str:
    """Run a notebook and return it as Markdown, its results below the cells."""
    scope: dict[str, Any] = {"__name__": "notebook"}
    return "\n\n".join(piece for cell in json.loads(text)["cells"] for piece in _shown(cell, scope))


def _shown(cell: dict[str, Any], scope: dict[str, Any]) -> Iterator[str]:
    source = "".join(cell["source"])
    if cell["cell_type"] == "markdown":
        yield source
        return
    yield f"```python\n{source}\n```"
    *body, last = ast.parse(source).body
    value, out = None, io.StringIO()
    with redirect_stdout(out):
        exec(compile(ast.Module(body, []), "cell", "exec"), scope)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), "cell", "eval"), scope)
        else:
            exec(compile(ast.Module([last], []), "cell", "exec"), scope)
    shown = [getattr(value, form)() for form in ("_repr_html_", "_repr_svg_") if hasattr(value, form)]
    if page := next(filter(None, shown), None):
        page = page.replace('border="1" class="dataframe"', 'class="docutils"')
        yield f'````{{raw}} html\n<div class="result">{page}</div>\n````'
    elif printed := out.getvalue() + ("" if value is None else f"{value!r}\n"):
        yield f"```text\n{printed}```"


def append(_app: object, page: str, source: list[str]) -> None:
    """Add to the text of a page what is generated for it."""
    made = {"docs/commands": commands, "docs/keys": keys, "docs/python": names}
    if page in made:
        source[0] += f"\n{made[page]()}\n"
    elif page == "docs/notebook":
        source[0] = notebook(source[0])
