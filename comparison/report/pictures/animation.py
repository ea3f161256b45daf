"""Animation of the press and of the magnified slider as one offline HTML file."""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from comparison.files import plain, replacing
from comparison.formatting import quantity
from comparison.report.decimate import envelope
from comparison.report.pictures.drawing import ARROW, GAP, SLIDER, corners, largest_force, press_box
from comparison.report.pictures.motion import Motion
from comparison.report.templates import TEMPLATES, script_hash, style
from comparison.tables.arrays import Array
from comparison.tables.channels import CORNERS

_WIDTH = 420.0  # of the press
_LEFT, _RIGHT, _TOP, _BOTTOM = 60.0, 850.0, 20.0, 130.0  # of the trace
_LINKS = {"crank": "OA", "rod2": "AB", "rocker": "HC", "rod4": "CF"}
_ORDER = ("ll", "lr", "ur", "ul")  # of the corners around the slider


def write_animation(motion: Motion, path: Path, *, title: str, command: str) -> Path:
    """Write the animation into one HTML file that needs nothing else.

    Parameters
    ----------
    motion
        Of one table or two.
    path
        The file; its folder is made.
    title, command
        Heading, and what reproduces the page.
    """
    assets = files("comparison.report.pictures").joinpath("assets")
    script = assets.joinpath("animation.js").read_text("utf-8")
    html = TEMPLATES.from_string(assets.joinpath("animation.html.j2").read_text("utf-8")).render(
        title=title,
        command=command,
        labels=list(motion.sliders),
        frames=len(motion.time),
        words=_words(motion),
        guide_words=_guide_words(motion),
        first_words=f"{motion.time[0]:.4f} s, crank cycle {motion.cycle[0]:.3f}",
        wall=SLIDER[0] / 2 + (GAP if motion.clearance else 0.0),
        css=style(),
        script=Markup(script),
        script_hash=script_hash(script),
        **_drawn(motion),
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as part:
        part.write_text(html, "utf-8")
    return path


def _drawn(motion: Motion) -> dict[str, Any]:
    """Return the first frame, the trace and the positions of all frames, in units of the drawings."""
    box = press_box(motion)
    scale = _WIDTH / box.width
    links = {
        name: np.round((points - (box.left, box.bottom + box.height)) * (scale, -scale), 2)
        for name, points in motion.links.items()
    }
    block = np.round(scale * np.array(motion.size), 2)
    outlines = {label: np.round(corners(motion, label) * (1.0, -1.0), 2) for label in motion.sliders}
    first = {name: points[0].tolist() for name, points in links.items()}
    most = largest_force(motion) or 1.0
    guide = float(links["F"][0, 0])
    data = {
        "time": motion.time,
        "cycle": np.round(motion.cycle, 5),
        "links": links,
        "block": block,
        "sliders": list(outlines.values()),
        # Square root: small forces beside the peak of the first impact remain visible.
        "forces": [
            [np.round(ARROW * np.sqrt(of[corner] / most), 1) for corner in _ORDER]
            for of in motion.forces.values()
        ],
    }
    assert set(_ORDER) == set(CORNERS)
    text = json.dumps(plain(_lists(data)), separators=(",", ":"), allow_nan=False)
    height = round(scale * box.height, 1)
    return {
        "data": Markup(text.replace("<", "\\u003c")),
        "polygons": [" ".join(f"{x},{y}" for x, y in of[0]) for of in outlines.values()],
        "press": {
            "height": height,
            "walls": [
                [round(guide + side * (block[0] / 2 + 3) - 3, 1), 0, 6, height] for side in (-1.0, 1.0)
            ],
            "block": [*block, round(first["F"][0] - block[0] / 2, 2), round(first["F"][1] - block[1] / 2, 2)],
            "links": {name: [*first[ends[0]], *first[ends[1]]] for name, ends in _LINKS.items()},
            "joints": first,
        },
        "trace": _trace(motion),
    }


def _trace(motion: Motion) -> dict[str, Any]:
    """Return x relative to the guide over time: title, ticks of both axes, and a curve of each table."""
    values = {label: of[:, 0] * 1e3 for label, of in motion.sliders.items()}
    top = max([1e3 * motion.clearance, *(float(np.abs(of).max()) for of in values.values())]) or 1.0
    start, end = float(motion.time[0]), float(motion.time[-1])

    def across(time: Array) -> Array:
        return _LEFT + (_RIGHT - _LEFT) * (time - start) / (end - start)

    def up(value: Array | float) -> Any:
        return (_TOP + _BOTTOM) / 2 - value / top * (_BOTTOM - _TOP) / 2

    curves = []
    for of in values.values():
        kept = envelope(of, 800)
        points = zip(across(motion.time[kept]), up(of[kept]), strict=True)
        curves.append(" ".join(f"{x:.1f},{y:.1f}" for x, y in points))
    ticks = np.linspace(start, end, 9)
    return {
        "title": "slider x − guide (mm) over time (s)",
        "y": [[float(up(value)), f"{value:.3g}"] for value in (-top, 0.0, top)],
        "x": [[round(float(x), 1), f"{time:.3g}"] for x, time in zip(across(ticks), ticks, strict=True)],
        "curves": curves,
    }


def _words(motion: Motion) -> str:
    cycles, seconds = (float(of[-1] - of[0]) for of in (motion.cycle, motion.time))
    return f"{' and '.join(motion.sliders)}, {seconds:.4g} s, {cycles:.3g} crank cycles."


def _guide_words(motion: Motion) -> str:
    if not motion.clearance:
        return "The slider in its guide; it has no clearance."
    clearance, most = quantity(motion.clearance, "m"), largest_force(motion)
    said = f"The slider in its guide; displacement magnified, clearance {clearance} a side."
    return said + (f" Lines at the corners: normal force, the longest {quantity(most, 'N')}." if most else "")


def _lists(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _lists(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_lists(part) for part in value]
    return value.tolist() if isinstance(value, np.ndarray) else value
