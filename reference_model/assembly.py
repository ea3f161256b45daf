"""Before the first step: whether the linkage can be assembled, and the forces of a workpiece on it."""

import math
from typing import NamedTuple

import numpy as np

from reference_model.linkage import Array, four_bar_rods
from reference_model.parameters import Parameters
from reference_model.workpiece import exists, load_force

_MARKS = 1000
"""Instants of a cycle at which the rocker's tip is looked at, and again about the outermost two."""


class Start(NamedTuple):
    """Force of the workpiece, N: on the slider at t = 0, and the largest on an ideal one; 0 without one."""

    load_at_start: float
    largest_load: float


def assemble(p: Parameters) -> Start:
    """Close the linkage at the start and over a whole cycle.

    Raises
    ------
    ValueError
        One line, where it does not close, or the force of the workpiece is not finite.
    """
    _require_four_bar(p)
    m = p.mechanism
    tip_x, tip_y = _tip(p, np.linspace(0.0, p.period, _MARKS + 1))
    for outermost in (tip_x.argmin(), tip_x.argmax()):
        near = p.period / _MARKS * (outermost + np.linspace(-1.0, 1.0, _MARKS + 1))
        tip_x, tip_y = (np.concatenate(pair) for pair in zip((tip_x, tip_y), _tip(p, near), strict=True))
    # With clearance the slider is about the centre line; reliabilities refer to the ideal slider's.
    lines = [m.line_x] if p.ideal_slider else [m.line_x, p.guide_x]
    if any(np.abs(x - tip_x).max() >= m.L4 for x in lines):
        raise ValueError("mechanism: rod 4 is too short: it does not reach the guide all the way round")
    first_x, first_y = _tip(p, np.zeros(1))
    rest = m.L4**2 - (p.reach[0] - first_x) ** 2
    if not rest > 0.0:
        raise ValueError(f"initial.slider_offset = {p.slider_offset!r} m: rod 4 does not reach that far")
    if not exists(p.load):
        return Start(0.0, 0.0)
    heights = tip_y + m.slider_branch * np.sqrt(m.L4**2 - (m.line_x - tip_x) ** 2)
    start = first_y + m.slider_branch * np.sqrt(rest)
    with np.errstate(over="ignore"):
        at_start, largest = (float(load_force(p.load, y).max()) for y in (start, heights))
    if not math.isfinite(at_start + largest):
        raise ValueError(
            f"load.surface = {p.load.surface!r} m: the load on a slider down to y = {heights.min():.3g} m is "
            "beyond the numbers of the machine"
        )
    return Start(at_start, largest)


def _tip(p: Parameters, times: Array) -> tuple[Array, Array]:
    """Return the position of the rocker's tip C (m) at times (s)."""
    m = p.mechanism
    _, (c3, s3, *_) = four_bar_rods(m, times)
    return m.Hx + m.L3 * c3, m.Hy + m.L3 * s3


def _require_four_bar(p: Parameters) -> None:
    """Raise unless the four-bar O-A-B-H closes over the whole revolution of the crank."""
    m = p.mechanism
    pivot = math.hypot(m.Hx, m.Hy)
    near, far = abs(pivot - m.L1), pivot + m.L1
    longest, shortest = m.L2 + m.Ls3, abs(m.L2 - m.Ls3)
    if far >= longest or near <= shortest:
        raise ValueError(
            f"mechanism: the linkage cannot be assembled over a whole revolution: crank pin to rocker pivot "
            f"is {near:.6g}..{far:.6g} m, rod 2 and rocker reach {shortest:.6g}..{longest:.6g} m"
        )
