"""Shorter text of a drawing, to the same tenth of a point: a page has a dozen of them per scene.

Matplotlib repeats the style of every part and groups each by itself; the page's style sheet has the font and
the joins of lines for all drawings.
"""

from __future__ import annotations

import re

_PATH = re.compile(r'(?<= d=")([^"]*)(?=")')
_STEP = re.compile(r"([ML])([^MLz]*)|z")
_PLACE = re.compile(r' (x|y|width|height)="(-?\d+\.\d\d+)"')
_STYLE = re.compile(r'(?<= style=")([^"]*)(?=")')
_SHEET = re.compile(r'<defs><style type="text/css">[^<]*</style></defs>')
_UNTURNED = re.compile(r' transform="rotate\(-?0 [^"]*"')
_GROUP = re.compile(r"<(/?)g(?: [^>]*)?(?<!/)>")
_DROPPED = ("font-family:", "stroke-linejoin:", "stroke-dashoffset: 0")
_PLAIN = re.compile(r"(?:[ML]-?\d*\.?\d+ -?\d*\.?\d+|z)*")


def compact(svg: str) -> str:
    """Return the drawing with less text: relative paths, tenths of a point, no groups or styles in vain.

    Paths with curves, or with more than one decimal, stay as they are.
    """
    svg = _UNTURNED.sub("", _SHEET.sub("", svg)).replace("<g/>", "")
    svg = _PLACE.sub(lambda match: f' {match[1]}="{_tenths(round(10 * float(match[2])))}"', svg)
    svg = _STYLE.sub(lambda match: _style(match[1]), svg)
    return _ungrouped(_PATH.sub(lambda match: _relative(match[1]), svg))


def _style(declarations: str) -> str:
    kept = (part.strip() for part in declarations.split(";"))
    return ";".join(part.replace(": ", ":") for part in kept if part and not part.startswith(_DROPPED))


def _ungrouped(svg: str) -> str:
    """Return the drawing without groups that have no attribute."""
    kept: list[bool] = []

    def piece(match: re.Match[str]) -> str:
        if match[1]:
            return match[0] if kept.pop() else ""
        kept.append(match[0] != "<g>")
        return match[0] if kept[-1] else ""

    return _GROUP.sub(piece, svg)


def _relative(path: str) -> str:
    if not _PLAIN.fullmatch(path):
        return path
    parts: list[str] = []
    here = start = (0, 0)
    last = ""
    for step in _STEP.finditer(path):
        if step[0] == "z":
            parts.append("z")
            here, last = start, "z"
            continue
        x, y = (10 * float(number) for number in step[2].split())
        to = round(x), round(y)
        if abs(x - to[0]) > 1e-6 or abs(y - to[1]) > 1e-6:
            return path
        numbers = _joined(to[0] - here[0], to[1] - here[1])
        if step[1] == "M":
            # The first of a path is absolute in either case.
            parts.append(f"m{numbers}")
            start = to
        elif last in {"m", "l"}:  # lines follow a start, or lines, without a letter
            parts.append(numbers if numbers.startswith("-") else f" {numbers}")
        else:
            parts.append(f"l{numbers}")
        here, last = to, step[1].lower()
    return "".join(parts)


def _joined(x: int, y: int) -> str:
    first, second = _tenths(x), _tenths(y)
    return first + (second if second.startswith("-") else f" {second}")


def _tenths(value: int) -> str:
    """Return a tenth of an integer as short as SVG permits: "1.5", "-.3", "2"."""
    whole, tenth = divmod(abs(value), 10)
    text = (str(whole) if whole or not tenth else "") + (f".{tenth}" if tenth else "")
    return f"-{text}" if value < 0 else text
