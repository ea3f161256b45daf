"""The cheap look at a scene: one run of the tree, and the reference's family, which costs a tenth of that.

What can be known without the tree's family is the reference's uncertainty u_r. The uncertainty of a
difference is never less: u >= u_r. So a sample at which u_r is too large to be predictable is not judged in
the full comparison either, and one at which the two are no more than k u_r apart is explained there. What is
left may speak against agreement. It is worth four more runs of the tree where it is more than `LIMIT` in
slider_x, or as much in another channel of the motion on that channel's scale: a hit that one model misses
turns the slider by far more than it moves it (measured: 9e-10 m in x beside three times the threshold in the
angular velocity).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from comparison.accuracy.thresholds import thresholds
from comparison.scene import Scene
from comparison.tables.channels import channels
from comparison.tables.table import Table
from comparison.verdict.compare import Runs, model_uncertainty

TIER = "tight"
LIMIT = 1e-8
"""m: the largest u of a predictable sample of slider_x at the tight tier with 0.2 mm of clearance."""
MOTION = ("slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")


@dataclass(frozen=True)
class Screening:
    """What the cheap look shows."""

    parted: bool
    """Whether the single runs part, see `screen`."""
    time: float | None
    channel: str
    """s: the first sample at which they do, and where; None and "" where they do not."""
    distance: float
    """Largest between the runs over the samples that the reference's runs show as predictable, on the scale
    of each channel, times the clearance: in m for slider_x."""
    coverage: float
    """Share of these samples, of the positions the least: the most that both families can show."""


def clearance(scene: Scene) -> float:
    """Return the clearance that moves the slider, m: that of the pin where the slider has none."""
    joint = "slider" if scene.data["joints"]["slider"] == "clearance" else "crank_pin"
    return float(scene.data["clearance"][joint])


def screen(scene: Scene, reference: Runs, tree: Table) -> Screening:
    """Compare one run of the tree with the reference.

    The two part where in a channel of the motion any sample before the first unpredictable stretch may speak
    against agreement, or more of all predictable samples than a verdict lets pass.
    """
    limits, size = thresholds(TIER), clearance(scene)
    parted, farthest, coverage = [], 0.0, 1.0
    for name in MOTION:
        channel = channels()[name]
        a, b = reference.base.values(name), tree.values(name)
        extent = float(max(a.max(), b.max()) - min(a.min(), b.min()))
        u = model_uncertainty(reference, name, scene.period)
        if u is None or extent < channel.floor:
            continue
        scale = channel.scale_value(scene.data, extent)
        predictable, apart = u <= limits.alpha * scale, np.abs(a - b)
        against = predictable & (apart > np.maximum(LIMIT / size * scale, limits.k * u))
        known = np.logical_and.accumulate(predictable)
        if (against & known).any() or against.sum() > (1.0 - limits.share) * predictable.sum():
            parted.append((float(tree.time[against.argmax()]), name))
        farthest = max(farthest, float(apart[predictable].max(initial=0.0)) / scale)
        if channel.rate is not None:
            coverage = min(coverage, float(predictable.mean()))
    time, where = min(parted, default=(None, ""))
    return Screening(bool(parted), time, where, farthest * size, coverage)
