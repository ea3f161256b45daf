"""Schematic of the press and of the slider in its guide, as SVG with the scene's dimensions.

The page's script moves the same drawing through the run: it addresses the parts by their classes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup, escape

from comparison.formatting import NO_BREAK
from comparison.report.mechanism import Joints, Point, joints

WIDTH, HEIGHT = 600, 330
_GUIDE = (448.0, 172.0)  # centre of the enlarged slider
_SLIDER = (70.0, 118.0)  # its width and height
_GAP = 18.0  # of the drawing is the clearance
_PRESS = (16.0, 34.0, 300.0, 250.0)  # left, top, width, height


@dataclass(frozen=True)
class Schematic:
    """Drawing, its texts, and what the script needs to move it."""

    svg: Markup
    caption: str
    alt: str
    geometry: dict[str, Any]


def schematic(scene: Mapping[str, Any] | None) -> Schematic | None:
    """Draw the press of a scene at its start.

    Parameters
    ----------
    scene
        The scene mapping; without one, or where the mechanism cannot be assembled, there is no drawing.
    """
    if scene is None:
        return None
    mechanism = scene["mechanism"]
    start = joints(mechanism, float(mechanism["crank_angle_deg"]))
    if start is None:
        return None
    view = _View(start, mechanism)
    clearance = float(scene["clearance"]["slider"]) if scene["joints"]["slider"] == "clearance" else 0.0
    pin = float(scene["clearance"]["crank_pin"]) if scene["joints"]["crank_pin"] == "clearance" else 0.0
    parts = [*_press(view, start, mechanism), *_enlarged(scene, clearance, pin)]
    svg = f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" focusable="false">{"".join(parts)}</svg>'
    words = _words(scene, clearance, pin)
    return Schematic(
        svg=Markup(svg),  # numbers, and the texts of this module
        caption=words,
        alt=f"Schematic of the six-bar press at the start, and its slider in the guide enlarged. {words}",
        geometry={
            "mechanism": {
                "crank": mechanism["crank"]["length"],
                "rod2": mechanism["rod2"]["length"],
                "centroid": mechanism["rocker"]["centroid"],
                "rocker": mechanism["rocker"]["length"],
                "rod4": mechanism["rod4"]["length"],
                "pivot": list(mechanism["rocker_pivot"]),
                "branches": [mechanism["rocker_branch"], mechanism["slider_branch"]],
                "start": mechanism["crank_angle_deg"],
                "speed": scene["drive"]["speed_rpm"] * 6.0,
            },
            "guide": mechanism["guide_x"],
            "length": mechanism["slider"]["length"],
            "view": [view.scale, *view.origin],
            # Pixels of the enlarged drawing per metre of clearance; 0 where the guide holds the slider.
            "magnified": _GAP / clearance if clearance else 0.0,
            "slider": [*_GUIDE, *_SLIDER],
        },
    )


class _View:
    """Map from metres to the drawing of the press."""

    def __init__(self, start: Joints, mechanism: Mapping[str, Any]) -> None:
        crank, slider = float(mechanism["crank"]["length"]), float(mechanism["slider"]["length"])
        xs = [point[0] for point in start] + [-crank, crank]
        # The stroke is some four cranks long; the slider starts near its top.
        ys = [point[1] for point in start] + [-crank, start.F[1] - 5.5 * crank - slider]
        left, top, width, height = _PRESS
        self.scale = min(width / (max(xs) - min(xs)), height / (max(ys) - min(ys)))
        self.origin = (left + 14 - self.scale * min(xs), top + self.scale * max(ys))

    def __call__(self, point: Point) -> Point:
        return self.origin[0] + self.scale * point[0], self.origin[1] - self.scale * point[1]


def _press(view: _View, start: Joints, mechanism: Mapping[str, Any]) -> list[str]:
    at = Joints(*(view(point) for point in start))
    half = 0.5 * view.scale * float(mechanism["slider"]["width"])
    tall = view.scale * float(mechanism["slider"]["length"])
    guide_x, bottom = at.F[0], _PRESS[1] + _PRESS[3]
    length = {name: _mm(mechanism[name]["length"]) for name in ("crank", "rod2", "rocker", "rod4")}
    return [
        _text(8, 16, "press at the start", "heading"),
        *(
            _line((x, at.F[1] - 0.8 * tall), (x, bottom), "wall")
            for x in (guide_x - half - 3, guide_x + half + 3)
        ),
        _line(at.O, at.A, "link crank"),
        _line(at.A, at.B, "link rod2"),
        _line(at.H, at.C, "link rocker"),
        _line(at.C, at.F, "link rod4"),
        f'<rect class="body slider" x="{at.F[0] - half:.1f}" y="{at.F[1] - tall / 2:.1f}" '
        f'width="{2 * half:.1f}" height="{tall:.1f}"/>',
        *(_ground(point) for point in (at.O, at.H)),
        *(
            f'<circle class="joint at-{name}" cx="{p[0]:.1f}" cy="{p[1]:.1f}" r="3"/>'
            for name, p in at._asdict().items()
        ),
        _text(at.O[0] + 10, at.O[1] + 17, f"crank {length['crank']}"),
        _text((at.A[0] + at.B[0]) / 2 + 10, (at.A[1] + at.B[1]) / 2 + 12, f"rod 2 {length['rod2']}"),
        _text((at.C[0] + at.B[0]) / 2, (at.C[1] + at.B[1]) / 2 - 9, f"rocker {length['rocker']}"),
        _text((at.C[0] + at.F[0]) / 2 + 8, (at.C[1] + at.F[1]) / 2, f"rod 4 {length['rod4']}"),
        _text(guide_x + half + 9, (at.F[1] + tall / 2 + bottom) / 2 + 10, "slider in"),
        _text(guide_x + half + 9, (at.F[1] + tall / 2 + bottom) / 2 + 24, "its guide"),
    ]


def _enlarged(scene: Mapping[str, Any], clearance: float, pin: float) -> list[str]:
    (x, y), (width, height) = _GUIDE, _SLIDER
    gap = _GAP if clearance else 0.0
    wall, top, bottom = width / 2 + gap, y - height / 2 - 30, y + height / 2 + 30
    mechanism = scene["mechanism"]
    across, tall = (_mm(mechanism["slider"][name]) for name in ("width", "length"))
    half = (width / 2, height / 2)
    corners = [(x + i * half[0], y + j * half[1]) for i, j in ((-1, 1), (1, 1), (1, -1), (-1, -1))]
    outline = " ".join(f"{a:.1f},{b:.1f}" for a, b in corners)
    return [
        _text(_GUIDE[0], 16, "slider in its guide, enlarged", "heading middle"),
        *(
            f'<rect class="ground" x="{left:.1f}" y="{top:.1f}" width="14" height="{bottom - top:.1f}"/>'
            for left in (x - wall - 14, x + wall)
        ),
        *(_line((edge, top), (edge, bottom), "wall") for edge in (x - wall, x + wall)),
        _line((x, top), (x, bottom), "centre"),
        f'<polygon class="body first" points="{outline}"/>',
        f'<polygon class="body second" points="{outline}"/>',
        *(
            f'<path class="force {model} {corner}" d=""/>'
            for model in ("first", "second")
            for corner in ("ll", "lr", "ul", "ur")
        ),
        *(
            [
                _text(x + wall + 18, top + 10, f"c = {_mm(clearance)}"),
                _text(x + wall + 18, top + 24, "a side"),
            ]
            if clearance
            else [_text(x + wall + 18, top + 10, "no clearance")]
        ),
        _text(x + wall + 18, y + 4, f"L = {tall}"),
        _text(x, bottom + 16, f"W = {across}", "middle"),
        *([_text(x + wall + 18, bottom, f"pin A: {_mm(pin)}")] if pin else []),
        *(
            _text(x + i * (wall + 20), y + j * half[1] + 4, name, "middle small")
            for name, i, j in (("ll", -1, 1), ("ul", -1, -1))
        ),
    ]


def _words(scene: Mapping[str, Any], clearance: float, pin: float) -> str:
    drive, mechanism = scene["drive"], scene["mechanism"]
    said = f"Crank at {mechanism['crank_angle_deg']:g}° at the start, {drive['speed_rpm']:g} rpm; slider "
    said += f"{_mm(mechanism['slider']['width'])} wide and {_mm(mechanism['slider']['length'])} long, "
    said += f"clearance {_mm(clearance)} on each side" if clearance else "held by its guide"
    return said + (f"; radial clearance at the crank pin A {_mm(pin)}." if pin else ".")


def _mm(metres: float) -> str:
    return f"{1e3 * metres:.6g}{NO_BREAK}mm"


def _line(a: Point, b: Point, kind: str) -> str:
    return f'<line class="{kind}" x1="{a[0]:.1f}" y1="{a[1]:.1f}" x2="{b[0]:.1f}" y2="{b[1]:.1f}"/>'


def _text(x: float, y: float, text: str, kind: str = "") -> str:
    name = f' class="{kind}"' if kind else ""
    return f'<text{name} x="{x:.1f}" y="{y:.1f}">{escape(text)}</text>'


def _ground(point: Point) -> str:
    x, y = point
    return f'<path class="support" d="M{x:.1f} {y:.1f}l-7 11h14z"/>'
