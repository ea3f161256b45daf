"""The two pictures of `index.md`; ``python docs/pictures.py`` writes them.

Each is on white, as wide as a phone shows at full size: so it is readable on a dark page too.
"""

from __future__ import annotations

from pathlib import Path

from comparison.report.page import joints
from comparison.scene import load_scene

STYLE = (
    "text{font:13px 'DejaVu Sans',Verdana,sans-serif;fill:#1c1c1c}.middle{text-anchor:middle}"
    ".link,.wall,.body,.joint{stroke:#1c1c1c;stroke-width:2}.link{stroke-width:4;stroke-linecap:round}"
    ".body{fill:#dce9f2}.frame{fill:#cfcfcf}.joint{fill:#fff}"
    ".force{stroke:#b3261e;fill:none;stroke-width:3}text.force{fill:#b3261e;stroke:none}"
    ".size{stroke:#005a9c;fill:none;stroke-width:1.5}text.size{fill:#005a9c;stroke:none}"
)


def mechanism() -> str:
    """Return the press of the paper as SVG; its slider is drawn larger."""
    places = joints(load_scene("150rpm-0.2mm").data["mechanism"], 40.0)
    assert places is not None
    at = {name: 226 + 180j + 350 * p.conjugate() for name, p in places.items()}  # px
    slider = at["F"]
    parts = _guide(slider.real, 21.0, slider.imag - 62, slider.imag + 75)
    parts += [f'<path class="frame" d="M{p.real:.1f} {p.imag:.1f}l-9 16h18z"/>' for p in (at["O"], at["H"])]
    parts += [_body(slider, 16, 22, 0.0)]
    parts += [_path("link", at[a], at[b]) for a, b in ("OA", "AB", "HC", "CF")]
    parts += [f'<circle class="joint" cx="{p.real:.1f}" cy="{p.imag:.1f}" r="4"/>' for p in at.values()]
    parts += [
        _text(at["A"] + (8 - 4j), "crank, driven"),
        _text((at["A"] + at["B"]) / 2 + 8, "rod 2"),
        _text((at["C"] + at["H"]) / 2 - 16j, "rocker"),
        _text((at["C"] + slider) / 2 + (26 + 6j), "rod 4"),
        _text(slider + (44 + 8j), "slider in its guide,"),
        _text(slider + (44 + 25j), "with clearance"),
    ]
    return _svg(340, 232, "The six-bar press: crank, rod 2, rocker, rod 4, and a slider in its guide", parts)


def contact() -> str:
    """Return the slider tilted in its guide as SVG: one corner in contact, the others open."""
    turn, wall, centre = -0.14, 70.0, 176 + 118j
    rotated = complex(1.0, -turn) / abs(complex(1.0, turn))  # y is downwards
    half_width, half_length = 44.0, 62.0
    # The lower left corner is inside its wall, by a depth that is drawn much too large.
    corners = {
        name: centre + complex(x * half_width, -y * half_length) * rotated
        for name, x, y in (("ll", -1, -1), ("lr", 1, -1), ("ul", -1, 1), ("ur", 1, 1))
    }
    left = corners["ll"].real + 5.0
    middle = left + wall
    ll, ur = corners["ll"], corners["ur"]
    parts = [*_guide(middle, wall, 22, 214), _body(centre, half_width, half_length, turn)]
    inward = {"ll": 18 - 10j, "lr": -14 - 10j, "ul": 14 + 20j, "ur": -16 + 18j}
    parts += [_text(corners[name] + by, name, "middle") for name, by in inward.items()]
    parts += [
        _path("size", complex(ur.real, ur.imag), complex(middle + wall, ur.imag), heads="both"),
        _text(ur + (2 - 10j), "gap", "size"),
        _path("force", ll, ll + 62, heads="end"),
        _text(ll + (12 + 28j), "normal force", "force"),
        _path("force", ll, ll - 52j, heads="end"),
        _text(ll + (-106 - 40j), "friction,", "force"),
        _text(ll + (-106 - 23j), "against the slip", "force"),
        _text(ll + (-106 + 22j), "depth: gap < 0", "size"),
        _text(complex(middle + wall + 16, 214), "guide"),
    ]
    return _svg(340, 232, "One contact: the slider's lower left corner inside the wall of its guide", parts)


def _text(p: complex, words: str, kind: str = "") -> str:
    words = words.replace("<", "&lt;")
    return f'<text class="{kind}" x="{p.real:.1f}" y="{p.imag:.1f}">{words}</text>'


def _path(kind: str, a: complex, b: complex, heads: str = "") -> str:
    """Return a line, with the head of an arrow at its "end" or at "both" ends."""
    strokes, along = [(a, b)], 8 * (b - a) / abs(b - a)
    if heads:
        strokes += [(b - along * (1 + 0.45j), b), (b, b - along * (1 - 0.45j))]
    if heads == "both":
        strokes += [(a + along * (1 + 0.45j), a), (a, a + along * (1 - 0.45j))]
    lines = "".join(f"M{p.real:.1f} {p.imag:.1f}L{q.real:.1f} {q.imag:.1f}" for p, q in strokes)
    return f'<path class="{kind}" d="{lines}"/>'


def _body(p: complex, half_width: float, half_length: float, turn: float) -> str:
    box = f'x="{-half_width}" y="{-half_length}" width="{2 * half_width}" height="{2 * half_length}"'
    place = f"translate({p.real:.1f} {p.imag:.1f}) rotate({-57.2958 * turn:.2f})"
    return f'<rect class="body" transform="{place}" {box}/>'


def _guide(x: float, half: float, top: float, bottom: float) -> list[str]:
    grounds = [(x - half - 10, x - half), (x + half, x + half)]
    box = f'y="{top:.1f}" width="10" height="{bottom - top:.1f}"'
    parts = [f'<rect class="frame" x="{ground:.1f}" {box}/>' for ground, _ in grounds]
    return parts + [_path("wall", complex(wall, top), complex(wall, bottom)) for _, wall in grounds]


def _svg(width: int, height: int, title: str, parts: list[str]) -> str:
    size = f'width="{width}" height="{height}" viewBox="0 0 {width} {height}"'
    white = f'<rect width="{width}" height="{height}" fill="#fff"/>'
    head = [f'<svg xmlns="http://www.w3.org/2000/svg" {size}>', f"<title>{title}</title>"]
    return "\n".join([*head, f"<style>{STYLE}</style>", white, *parts, "</svg>", ""])


PICTURES = {"mechanism.svg": mechanism, "contact.svg": contact}
"""Files beside this one, and what draws them."""

if __name__ == "__main__":
    for name, draw in PICTURES.items():
        Path(__file__).with_name(name).write_text(draw(), "utf-8")
