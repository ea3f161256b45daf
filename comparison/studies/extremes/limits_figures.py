"""The drawings of the limits: measured points of both models and what theory says."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from comparison.execution.run import MODELS
from comparison.report import svg
from comparison.studies.extremes import elastic_limit, stiffness_limit
from comparison.studies.extremes.limits import Found

_MODELS = {"reference": ("o", svg.FIRST, 5.5), "exudyn": ("x", svg.SECOND, 4)}
_UNNAMED = "_unnamed"
"""A label for a line that another panel's stands for."""
_DASHES = ((None, None), (4, 1.5), (1, 1.5), (5, 1.5, 1, 1.5))


def draw(found: Found, folder: Path) -> None:
    """Write limit_clearance.svg, limit_stiffness.svg, limit_lossless.svg and limit_speed.svg."""
    with svg.style():
        _clearance(found, folder / "limit_clearance.svg")
        _stiffness(found, folder / "limit_stiffness.svg")
        _elastic(found, folder / "limit_lossless.svg")
        _speed(found, folder / "limit_speed.svg")


def _clearance(found: Found, path: Path) -> None:
    figure, left, right = _pair("clearance (m)")
    left.set_ylabel("largest deviation (m)")
    right.set_ylabel("largest deviation (m/s)", labelpad=1)
    for axes, names in ((left, ("x", "y")), (right, ("vx", "vy"))):
        for name, dashes in zip(names, _DASHES, strict=False):
            for model in MODELS:
                rows = [row for row in found.clearance if row.model == model]
                points = [(row.clearance, getattr(row, name)) for row in rows]
                _points(axes, points, model, f"{name}, {model}", dashes)
    _theory(left, (1e-5, 1e-3), 1e-5, 1.0, "order 1")
    _theory(right, (1e-5, 1e-3), 8e-3, 0.5, "order 1/2")
    _finish(figure, (left, right), path)


def _stiffness(found: Found, path: Path) -> None:
    figure, left, right = _pair("Young's modulus (Pa)")
    left.set_ylabel("restitution − the law's")
    right.set_ylabel("depth (m)", labelpad=1)
    for corners, dashes in zip(stiffness_limit.TILTS, _DASHES, strict=False):
        for model in MODELS:
            rows = [row for row in found.stiffness if (row.corners, row.model) == (corners, model)]
            label = f"{'two corners' if corners == 2 else 'one corner'}, {model}"
            law = stiffness_limit.exact()
            _points(left, [(row.modulus, abs(row.returned - law)) for row in rows], model, label, dashes)
            _points(right, [(row.modulus, row.deepest) for row in rows], model, _UNNAMED, dashes)
    _theory(left, (1e9, 1e15), 0.1, -0.4, "order −0.4")
    _theory(right, (1e9, 1e15), 3e-5, -0.4, _UNNAMED)
    _finish(figure, (left, right), path)


def _elastic(found: Found, path: Path) -> None:
    figure, left, right = _pair("tolerance, reference (rad)")
    left.set_ylabel("largest residual of energy (J)")
    right.set_xlabel("step, Exudyn (s)")
    for axes, model in ((left, "reference"), (right, "exudyn")):
        rows = [row for row in found.elastic if row.model == model and row.case == elastic_limit.BOTH]
        _points(axes, [(row.setting, row.residual) for row in rows], model, model, _DASHES[0])
    _theory(left, (1e-12, 1e-8), 1e-11, 1.0, "order 1")
    _theory(right, (1e-6, 1e-5), 4e-9, 2.0, "order 2", dashes=_DASHES[1])
    _finish(figure, (left, right), path)


def _speed(found: Found, path: Path) -> None:
    figure, left, right = _pair("speed (rpm)")
    left.set_ylabel("wall force − static (N)")
    right.set_ylabel("torque − static (N m)", labelpad=1)
    for friction, dashes in zip((0.0, 0.15), _DASHES, strict=False):
        for model in MODELS:
            rows = [row for row in found.speed if (row.friction, row.model) == (friction, model)]
            label = f"friction {friction:g}, {model}"
            _points(left, [(row.speed, row.force) for row in rows], model, label, dashes)
            if model == "reference":
                _points(right, [(row.speed, row.torque) for row in rows], model, _UNNAMED, dashes)
    _theory(left, (1.0, 60.0), 6e-5, 2.0, "order 2")
    _theory(right, (1.0, 60.0), 4e-5, 2.0, _UNNAMED)
    _finish(figure, (left, right), path)


def _pair(label: str) -> tuple[Figure, Axes, Axes]:
    figure = Figure(figsize=(5.56, 3.4))
    left = figure.add_axes((0.115, 0.13, 0.37, 0.65))
    right = figure.add_axes((0.61, 0.13, 0.37, 0.65))
    for axes in (left, right):
        axes.set(xscale="log", yscale="log", xlabel=label)
        axes.margins(x=0.04)
    return figure, left, right


def _points(
    axes: Axes,
    points: Sequence[tuple[float, float]],
    model: str,
    label: str,
    dashes: Sequence[float | None],
) -> None:
    mark, colour, size = _MODELS[model]
    x, y = zip(*points, strict=True)
    axes.plot(x, y, mark, ls="-", lw=0.8, dashes=dashes, color=colour, mfc="none", ms=size, label=label)


def _theory(
    axes: Axes,
    span: tuple[float, float],
    first: float,
    order: float,
    label: str,
    dashes: Sequence[float | None] = (None, None),
) -> None:
    """Draw a line of an order through (span[0], first)."""
    last = first * (span[1] / span[0]) ** order
    axes.plot(span, (first, last), color=svg.LIMIT, lw=3, alpha=0.5, zorder=0, dashes=dashes, label=label)


def _finish(figure: Figure, both: tuple[Axes, Axes], path: Path) -> None:
    lines = [line for axes in both for line in axes.get_lines() if line.get_label() != _UNNAMED]
    figure.legend(
        lines, [str(line.get_label()) for line in lines],
        loc="upper left", bbox_to_anchor=(0.02, 0.99), ncols=3, columnspacing=0.9,
    )  # fmt: skip
    svg.write_svg(figure, path)
