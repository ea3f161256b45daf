"""Drawing of the press and of the slider in its guide, as SVG with the scene's dimensions.

The pages' script moves the same drawing through the run: it addresses the parts by their classes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, hypot, radians, sin, sqrt
from typing import Any, NamedTuple

from markupsafe import Markup, escape

from comparison.formatting import NO_BREAK

WIDTH, HEIGHT = 600, 330
_GUIDE = (448.0, 172.0)  # centre of the enlarged slider
_SLIDER = (70.0, 118.0)  # its width and height
_GAP = 18.0  # of the drawing is the clearance
_PRESS = (16.0, 34.0, 300.0, 250.0)  # left, top, width, height

Point = tuple[float, float]


class Joints(NamedTuple):
    """Positions, m: crank's bearing O, crank pin A, B on the rocker, its pivot H, its tip C, slider F."""

    O: Point  # noqa: E741 - the paper's name
    A: Point
    B: Point
    H: Point
    C: Point
    F: Point


@dataclass(frozen=True)
class Schematic:
    """Drawing, its texts, and what the script needs to move it."""

    svg: Markup
    caption: str
    alt: str
    geometry: dict[str, Any]


def joints(mechanism: Mapping[str, Any], crank_angle_deg: float) -> Joints | None:
    """Return the joints' positions; None where the mechanism cannot be assembled.

    Both models compute their own; a drawing needs a tenth of a millimetre and neglects the clearances.

    Parameters
    ----------
    mechanism
        Section ``mechanism`` of a scene.
    crank_angle_deg
        From the x axis, counter-clockwise.
    """
    angle, crank = radians(crank_angle_deg), float(mechanism["crank"]["length"])
    pin = (crank * cos(angle), crank * sin(angle))
    pivot = (float(mechanism["rocker_pivot"][0]), float(mechanism["rocker_pivot"][1]))
    rocker, rod2 = mechanism["rocker"], mechanism["rod2"]
    middle = _crossing(pin, rod2["length"], pivot, rocker["centroid"], mechanism["rocker_branch"])
    if middle is None:
        return None
    reach = rocker["length"] / rocker["centroid"]
    tip = (pivot[0] + reach * (middle[0] - pivot[0]), pivot[1] + reach * (middle[1] - pivot[1]))
    guide = float(mechanism["guide_x"])
    left = mechanism["rod4"]["length"] ** 2 - (guide - tip[0]) ** 2
    if left < 0.0:
        return None
    slider = (guide, tip[1] + mechanism["slider_branch"] * sqrt(left))
    return Joints((0.0, 0.0), pin, middle, pivot, tip, slider)


def _crossing(a: Point, from_a: float, b: Point, from_b: float, side: int) -> Point | None:
    """Return where two circles cross, on the left (1) or right (-1) of the line from a to b."""
    distance = hypot(b[0] - a[0], b[1] - a[1])
    along = (distance**2 + from_a**2 - from_b**2) / (2 * distance)
    height = from_a**2 - along**2
    if height < 0.0:
        return None
    x, y = (b[0] - a[0]) / distance, (b[1] - a[1]) / distance
    across = side * sqrt(height)
    return a[0] + along * x - across * y, a[1] + along * y + across * x


def schematic(scene: Mapping[str, Any] | None) -> Schematic | None:
    """Draw the press of a scene at its start.

    Parameters
    ----------
    scene
        The scene mapping; without one, or where the mechanism cannot be assembled, there is no drawing.
    """
    if scene is None:
        return None
    mechanism, drive = scene["mechanism"], scene["drive"]
    start = joints(mechanism, float(mechanism["crank_angle_deg"]))
    if start is None:
        return None
    clearances = [
        float(scene["clearance"][joint]) if scene["joints"][joint] == "clearance" else 0.0
        for joint in ("slider", "crank_pin")
    ]
    clearance, pin = clearances
    # The stroke is some four cranks long; the slider starts near its top.
    crank, length = float(mechanism["crank"]["length"]), float(mechanism["slider"]["length"])
    xs = [point[0] for point in start] + [-crank, crank]
    ys = [point[1] for point in start] + [-crank, start.F[1] - 5.5 * crank - length]
    left, top, width, height = _PRESS
    scale = min(width / (max(xs) - min(xs)), height / (max(ys) - min(ys)))
    origin = (left + 14 - scale * min(xs), top + scale * max(ys))
    at = Joints(*((origin[0] + scale * x, origin[1] - scale * y) for x, y in start))
    parts = [*_press(at, mechanism, scale), *_enlarged(mechanism, clearance, pin)]
    size = f"{_mm(mechanism['slider']['width'])} wide and {_mm(length)} long"
    held = f"clearance {_mm(clearance)} on each side" if clearance else "held by its guide"
    caption = f"Crank at {mechanism['crank_angle_deg']:g}° at the start, {drive['speed_rpm']:g} rpm; "
    caption += f"slider {size}, {held}"
    caption += f"; radial clearance at the crank pin A {_mm(pin)}." if pin else "."
    return Schematic(
        # Numbers, and the texts of this module.
        svg=Markup(f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" focusable="false">{"".join(parts)}</svg>'),
        caption=caption,
        alt=f"Schematic of the six-bar press at the start, and its slider in the guide enlarged. {caption}",
        geometry={
            "mechanism": {
                "crank": crank,
                "rod2": mechanism["rod2"]["length"],
                "centroid": mechanism["rocker"]["centroid"],
                "rocker": mechanism["rocker"]["length"],
                "rod4": mechanism["rod4"]["length"],
                "pivot": list(mechanism["rocker_pivot"]),
                "branches": [mechanism["rocker_branch"], mechanism["slider_branch"]],
                "start": mechanism["crank_angle_deg"],
                "speed": drive["speed_rpm"] * 6.0,
            },
            "guide": mechanism["guide_x"],
            "length": length,
            "view": [scale, *origin],
            # Pixels of the enlarged drawing per metre of clearance; 0 where the guide holds the slider.
            "magnified": _GAP / clearance if clearance else 0.0,
            "slider": [*_GUIDE, *_SLIDER],
        },
    )


def _press(at: Joints, mechanism: Mapping[str, Any], scale: float) -> list[str]:
    half = 0.5 * scale * float(mechanism["slider"]["width"])
    tall = scale * float(mechanism["slider"]["length"])
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
        *(f'<path class="support" d="M{x:.1f} {y:.1f}l-7 11h14z"/>' for x, y in (at.O, at.H)),
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


def _enlarged(mechanism: Mapping[str, Any], clearance: float, pin: float) -> list[str]:
    (x, y), (width, height) = _GUIDE, _SLIDER
    wall = width / 2 + (_GAP if clearance else 0.0)
    top, bottom = y - height / 2 - 30, y + height / 2 + 30
    across, tall = (_mm(mechanism["slider"][name]) for name in ("width", "length"))
    corners = [(x + i * width / 2, y + j * height / 2) for i, j in ((-1, 1), (1, 1), (1, -1), (-1, -1))]
    outline = " ".join(f"{a:.1f},{b:.1f}" for a, b in corners)
    gap = [f"c = {_mm(clearance)}", "a side"] if clearance else ["no clearance"]
    return [
        _text(x, 16, "slider in its guide, enlarged", "heading middle"),
        *(
            f'<rect class="ground" x="{left:.1f}" y="{top:.1f}" width="14" height="{bottom - top:.1f}"/>'
            for left in (x - wall - 14, x + wall)
        ),
        *(_line((edge, top), (edge, bottom), "wall") for edge in (x - wall, x + wall)),
        _line((x, top), (x, bottom), "centre"),
        *(f'<polygon class="body {model}" points="{outline}"/>' for model in ("first", "second")),
        *(
            f'<path class="force {model} {corner}" d=""/>'
            for model in ("first", "second")
            for corner in ("ll", "lr", "ul", "ur")
        ),
        *(_text(x + wall + 18, top + 10 + 14 * n, text) for n, text in enumerate(gap)),
        _text(x + wall + 18, y + 4, f"L = {tall}"),
        _text(x, bottom + 16, f"W = {across}", "middle"),
        *([_text(x + wall + 18, bottom, f"pin A: {_mm(pin)}")] if pin else []),
        *(
            _text(x - wall - 20, y + j * height / 2 + 4, name, "middle small")
            for name, j in (("ll", 1), ("ul", -1))
        ),
    ]


def _mm(metres: float) -> str:
    return f"{1e3 * metres:.6g}{NO_BREAK}mm"


def _line(a: Point, b: Point, kind: str) -> str:
    return f'<line class="{kind}" x1="{a[0]:.1f}" y1="{a[1]:.1f}" x2="{b[0]:.1f}" y2="{b[1]:.1f}"/>'


def _text(x: float, y: float, text: str, kind: str = "") -> str:
    name = f' class="{kind}"' if kind else ""
    return f'<text{name} x="{x:.1f}" y="{y:.1f}">{escape(text)}</text>'
