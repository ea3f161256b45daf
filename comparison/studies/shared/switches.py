"""Where the law changes from corners to surface and back, and the energy that each change creates.

Under ``paper-switching`` the potential of a side jumps whenever its second corner touches or one of two
leaves. The motion does not jump there, so the energy residual does: by what was created, and nowhere else.
"""

from typing import Any

import numpy as np
import pandas as pd

from comparison.tables.channels import Array
from comparison.tables.table import Table

SIDES = (("ll", "ul"), ("lr", "ur"))


def contacts(run: Table) -> pd.DataFrame:
    """Return the contacts of a run with clearance, which has them always; a row each, by their start."""
    return pd.DataFrame() if run.events is None else run.events


def switches(events: pd.DataFrame) -> pd.DataFrame:
    """Return the instants at which the number of touching corners of a side becomes or ceases to be two.

    Columns ``time`` (s), ascending; ``to_surface``; ``corner``: the one that touches on both sides of the
    instant, whose depth decides how much energy is created.
    """
    rows = []
    for side in SIDES:
        touching = [events[events["corner"] == corner] for corner in side]
        # Both at once: from the later start to the earlier end, for each pair that overlaps.
        starts, ends = ([each[name].to_numpy(np.float64) for each in touching] for name in ("start", "end"))
        start, end = np.maximum.outer(*starts), np.minimum.outer(*ends)
        for i, j in np.argwhere(start < end):
            first = side[0] if starts[0][i] < starts[1][j] else side[1]
            last = side[0] if ends[0][i] > ends[1][j] else side[1]
            rows += [(start[i, j], True, first), (end[i, j], False, last)]
    frame = pd.DataFrame(rows, columns=["time", "to_surface", "corner"])
    return frame.sort_values("time", kind="stable", ignore_index=True)


def created(changes: pd.DataFrame, table: Table) -> Array:
    """Return the energy that each of `switches` created, J: minus the jump of the residual across it.

    Raises ValueError if two switches lie between the same two samples: their jumps cannot be separated.
    """
    after = np.searchsorted(table.time, changes["time"])
    if np.unique(after).size < after.size:
        closest, apart = np.diff(changes["time"]).min(), table.time[1]
        raise ValueError(f"samples {apart:.2g} s apart do not separate switches {closest:.2g} s apart")
    residual = table.values("energy_residual")
    return np.asarray(residual[after - 1] - residual[after])


def depths(changes: pd.DataFrame, table: Table, scene: dict[str, Any]) -> Array:
    """Return the depth (m) of the touching corner at each switch, shape (n,).

    The parabola through the three samples on the side of the switch where that corner touches alone: there
    the motion is gentle, beyond it the surface force bends it within a sample.
    """
    angle, x = table.values("slider_angle"), table.values("slider_x")
    slider, guide = scene["mechanism"]["slider"], scene["mechanism"]["guide_x"]
    half = slider["width"] / 2
    after = np.searchsorted(table.time, changes["time"])
    result = np.empty(len(changes))
    for n, (time, to_surface, corner) in enumerate(changes.itertuples(index=False, name=None)):
        first = max(0, after[n] - 3) if to_surface else min(after[n], angle.size - 3)
        part = slice(first, first + 3)
        right, up = (1.0 if corner[1] == "r" else -1.0), (1.0 if corner[0] == "u" else -1.0)
        # A corner's distance from the guide's centre line towards its wall, Eqs. 2-6.
        arm = right * half * np.cos(angle[part]) - up * slider["length"] / 2 * np.sin(angle[part])
        depth = right * (x[part] - guide + arm) - half - scene["clearance"]["slider"]
        s = (time - table.time[first + 1]) / (table.time[first + 1] - table.time[first])
        result[n] = np.dot([s * (s - 1) / 2, 1 - s * s, s * (s + 1) / 2], depth)
    return result


def corner_stiffness(contact: dict[str, Any]) -> float:
    """Return K of one corner, N/m^n (Eq. 10)."""
    return float(4 / (3 * _compliance(contact)) * np.sqrt(contact["corner_radius"]))


def _compliance(contact: dict[str, Any]) -> float:
    return float(2 * (1 - contact["poisson"] ** 2) / contact["youngs_modulus"])  # sigma_m + sigma_n, 1/Pa


def surplus(depth: Array, scene: dict[str, Any]) -> Array:
    """Return what the surface law stores more than the corner law, J, where the other corner just touches.

    K_s d^2 / 6 - K d^(n+1) / (n+1), from Eqs. 7-10: created when the surface law sets in, destroyed when it
    ends.
    """
    contact, slider = scene["contact"], scene["mechanism"]["slider"]
    K, n = corner_stiffness(contact), contact["exponent"]
    Ks = (slider["thickness"] + slider["length"]) / (0.475 * _compliance(contact))
    d = np.maximum(depth, 0.0)
    return np.asarray(Ks * d**2 / 6 - K * d ** (n + 1) / (n + 1))
