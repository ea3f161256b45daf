"""Drawing of the press and of the slider in its guide, as SVG with the scene's dimensions.

The pages' script moves the same drawing through the run: it addresses the parts by their classes.
"""

from cmath import rect
from collections.abc import Mapping
from math import radians, sqrt
from typing import Any

from markupsafe import Markup

from comparison.formatting import NO_BREAK
from comparison.report.templates import TEMPLATES

_SLIDER = (448.0, 172.0, 70.0, 118.0)  # centre, width and height of the enlarged slider
_GAP = 18.0  # of the drawing is the clearance
_LEFT, _TOP, _WIDTH, _HEIGHT = 16.0, 34.0, 300.0, 250.0  # of the press


def joints(mechanism: Mapping[str, Any], crank_angle_deg: float) -> dict[str, complex] | None:
    """Return positions (m): the crank's O and A, the rocker's B, pivot H and tip C, the slider's F.

    None where the mechanism cannot be assembled. The models compute their own; a drawing needs a tenth of a
    millimetre and neglects the clearances.
    """
    crank, rod2, rocker, rod4 = (mechanism[name] for name in ("crank", "rod2", "rocker", "rod4"))
    A, H = rect(crank["length"], radians(crank_angle_deg)), complex(*mechanism["rocker_pivot"])
    # B is where circles about A and H cross.
    distance = abs(H - A)
    along = (distance**2 + rod2["length"] ** 2 - rocker["centroid"] ** 2) / (2 * distance)
    across = rod2["length"] ** 2 - along**2
    if across < 0.0:
        return None
    B = A + (H - A) / distance * complex(along, mechanism["rocker_branch"] * sqrt(across))
    C = H + rocker["length"] / rocker["centroid"] * (B - H)
    below = rod4["length"] ** 2 - (mechanism["guide_x"] - C.real) ** 2
    if below < 0.0:
        return None
    F = complex(mechanism["guide_x"], C.imag + mechanism["slider_branch"] * sqrt(below))
    return {"O": 0j, "A": A, "B": B, "H": H, "C": C, "F": F}


def schematic(scene: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """Draw the press of a scene at its start, with texts and what the script needs to move it.

    None without a scene, or where the press cannot be assembled.
    """
    if scene is None:
        return None
    mechanism, drive = scene["mechanism"], scene["drive"]
    start = joints(mechanism, mechanism["crank_angle_deg"])
    if start is None:
        return None
    clearance, pin = (
        float(scene["clearance"][joint]) if scene["joints"][joint] == "clearance" else 0.0
        for joint in ("slider", "crank_pin")
    )
    # The stroke is some four cranks long; the slider starts near its top.
    crank, width, length = (
        mechanism[part][key] for part, key in (("crank", "length"), ("slider", "width"), ("slider", "length"))
    )
    xs = [point.real for point in start.values()] + [-crank, crank]
    ys = [point.imag for point in start.values()] + [-crank, start["F"].imag - 5.5 * crank - length]
    scale = min(_WIDTH / (max(xs) - min(xs)), _HEIGHT / (max(ys) - min(ys)))
    origin = complex(_LEFT + 14 - scale * min(xs), _TOP + scale * max(ys))
    drawing = TEMPLATES.get_template("schematic.svg.j2").render(
        at={name: origin + scale * point.conjugate() for name, point in start.items()},
        half=0.5 * scale * width,
        tall=scale * length,
        top=_TOP,
        height=_HEIGHT,
        slider=_SLIDER,
        gap=_GAP,
        mechanism=mechanism,
        clearance=clearance,
        pin=pin,
        mm=_mm,
    )
    held = f"clearance {_mm(clearance)} on each side" if clearance else "held by its guide"
    caption = f"Crank at {mechanism['crank_angle_deg']:g}° at the start, {drive['speed_rpm']:g} rpm; "
    caption += f"slider {_mm(width)} wide and {_mm(length)} long, {held}"
    caption += f"; radial clearance at the crank pin A {_mm(pin)}." if pin else "."
    about = "Schematic of the six-bar press at the start, and its slider in the guide enlarged."
    return {
        "svg": Markup(drawing.replace("\n", "")),
        "caption": caption,
        "alt": f"{about} {caption}",
        "geometry": {
            "mechanism": mechanism,
            "speed": drive["speed_rpm"] * 6.0,
            "view": [scale, origin.real, origin.imag],
            # Pixels of the enlarged drawing per metre of clearance; 0 where the guide holds the slider.
            "magnified": _GAP / clearance if clearance else 0.0,
            "slider": list(_SLIDER),
        },
    }


def _mm(metres: float) -> str:
    return f"{1e3 * metres:.6g}{NO_BREAK}mm"
