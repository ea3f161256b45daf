"""Load of a workpiece: a force along y on the slider's centre that depends on its height alone."""

from collections.abc import Mapping
from itertools import pairwise
from typing import Any


class Workpiece:
    """Force and stored energy by the height; ``kinks`` are the heights where the force has one."""

    def __init__(self, load: Mapping[str, Any]) -> None:
        self.surface, self.power, self.depth = load["surface"], load["force"], load["depth"]
        self.exponent, self.rows = load["exponent"], [tuple(row) for row in load["table"]]
        depths = [depth for depth, _ in self.rows] if self.rows else [0.0] * (self.power > 0.0)
        self.kinks = [self.surface - depth for depth in depths]

    def force(self, height: float) -> tuple[float, float]:
        """Return force (N) and stored energy (J) at a height of the centre."""
        h, energy = self.surface - height, 0.0
        if h <= 0.0 or not self.kinks:
            return 0.0, 0.0
        if not self.rows:
            force = self.power * (h / self.depth) ** self.exponent
            return force, force * h / (self.exponent + 1.0)
        for (h0, P0), (h1, P1) in pairwise(self.rows):
            if h <= h1:
                force = P0 + (P1 - P0) * (h - h0) / (h1 - h0)
                return force, energy + (P0 + force) / 2.0 * (h - h0)
            energy += (P0 + P1) / 2.0 * (h1 - h0)
        h0, P0 = self.rows[-1]
        return P0, energy + P0 * (h - h0)
