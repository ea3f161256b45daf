"""Statements about one condition's motion."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comparison.execution.job import MODELS
from comparison.formatting import number, quantity
from comparison.reliability.errors import Peak
from comparison.scene import load_scene
from comparison.studies.paper.decision import Decision, decide, per_cent
from comparison.studies.paper.runs import CHANNELS, PERTURBATION, Runs, second
from comparison.studies.paper.trends import contacts_by_cycle
from comparison.studies.shared.published import published
from comparison.tables.arrays import Array
from comparison.tables.channels import channels

BOTTOM = 0.02
"""s to either side of the printed instant of the lowest point: where a press does its work."""
SMALL = 0.01
"""Of the motion's own range: a smaller error is close."""
MANY = 3
"""Contacts in that time that count as frequent."""
OFTEN = 10
"""Contacts in a cycle that count as frequent."""
SETTLED = 0.5
"""Of the cycles, the later: what is said of the lasting motion is judged by them."""


def close(runs: Runs, model: str, claim: Mapping[str, Any]) -> Decision:
    """Decide whether a channel is close to the ideal one near the lowest point, in every scene of a claim."""
    channel = claim["channel"]
    shares, parts = [], []
    for scene in claim["scenes"]:
        ideal = runs.ideal[scene, model]
        largest = abs(_at_the_bottom(runs, scene, model, channel).value)
        shares.append(largest / float(np.ptp(ideal.values(channel))))
        error = quantity(largest, channels()[channel].unit)
        parts.append(f"{scene}: {error}, {per_cent(shares[-1])} of the range")
    return decide(-max(shares), -2 * SMALL, -SMALL, "; ".join(parts))


def contacts_at_the_bottom(runs: Runs, model: str, claim: Mapping[str, Any]) -> Decision:
    """Decide whether contacts are frequent near the lowest point of the second cycle."""
    scene = claim["scene"]
    run = runs.short[scene, model][0]
    largest = abs(_at_the_bottom(runs, scene, model, "slider_ay").value)
    starts = np.empty(0) if run.events is None else run.events["start"].to_numpy(dtype=np.float64)
    begin, end = _bottom(runs, scene, model)
    count = int(np.sum((starts >= begin) & (starts <= end)))
    evidence = f"{count} contacts within {1e3 * BOTTOM:g} ms of it, error up to {quantity(largest, 'm/s^2')}"
    return decide(float(count), 0.0, float(MANY), evidence)


def traversals(runs: Runs, model: str, claim: Mapping[str, Any]) -> Decision:
    """Decide whether the slider oscillates often in every cycle: by its contacts, and by the crossings."""
    scene = claim["scene"]
    data = load_scene(scene).data
    x = runs.by_cycle(runs.long[scene, model], "slider_x") - data["mechanism"]["guide_x"]
    offset = x / data["clearance"]["slider"]
    side = np.where(np.abs(offset) > 0.5, np.sign(offset), 0.0)
    counts = [int(np.sum(np.diff(row[row != 0]) != 0)) for row in side]
    fewest = float(contacts_by_cycle(runs, scene, model)["size"].min())
    evidence = (
        f"{number(fewest)} contacts a cycle or more; {min(counts)} to {max(counts)} crossings from half the "
        "clearance on one side to the other"
    )
    return decide(fewest if np.isfinite(fewest) else 0.0, 2.0, float(OFTEN), evidence)


def pin_zones(runs: Runs, model: str, claim: Mapping[str, Any]) -> Decision:
    """Decide whether the pin hits its bearing in the two zones on the left, by the impulse in each quadrant.

    The force on rod 2, which carries the bearing, points from the bearing's centre to the pin, but for
    friction, at most 9 degrees. If the authors drew the bearing against its pin, every quadrant is the
    opposite one.
    """
    force = pin_forces(runs, claim["scene"], model)
    total = float(np.abs(force).sum()) or 1.0
    quadrants = {"upper right": (1, 1), "upper left": (-1, 1), "lower left": (-1, -1), "lower right": (1, -1)}
    shares = {
        name: float(np.abs(force[(x * force.real > 0) & (y * force.imag > 0)]).sum()) / total
        for name, (x, y) in quadrants.items()
    }
    parts = ", ".join(f"{name} {per_cent(share)}" for name, share in shares.items())
    # As the authors say it, or as it would be in the other body's frame.
    zones = max(min(shares[f"upper {side}"], shares[f"lower {side}"]) for side in ("left", "right"))
    return decide(zones, 0.01, 0.1, f"impulse of the second cycle: {parts}")


def pin_forces(runs: Runs, scene: str, model: str) -> NDArray[np.complex128]:
    """Return the force of the pin on its bearing in the second cycle as x + iy, N, shape (n,)."""
    run = runs.pin[scene, model]
    force: NDArray[np.complex128] = run.values("reaction_A_x") + 1j * run.values("reaction_A_y")
    return force[second(run)]


def recurring(runs: Runs, model: str, claim: Mapping[str, Any]) -> Decision:
    """Decide whether the errors of one cycle resemble those of the next: the median of their correlations."""
    errors = _later(runs.long_errors(claim["scene"], model, claim["channel"]))
    pairs = [float(np.corrcoef(a, b)[0, 1]) for a, b in pairwise(errors)]
    middle = float(np.median(pairs))
    return decide(middle, 0.1, 0.9, f"correlation of neighbouring cycles {number(middle)} in the median")


def scattered(runs: Runs, model: str, claim: Mapping[str, Any]) -> Decision:
    """Decide whether the points of the Poincaré map are apart, against what the clearance allows.

    The paper does not say at which crank angle it takes them, so all angles count.
    """
    scene, channel = claim["scene"], claim["channel"]
    room = 2 * float(load_scene(scene).data["clearance"]["slider"])
    if channel == "slider_y":  # what the clearance lets y differ by where rod 4 is steepest
        room *= abs(published("F14e-y2").value / published("F14a-x").value)
    width = np.ptp(_later(runs.by_cycle(runs.long[scene, model], channel)), axis=0)
    share = float(np.mean(width >= SMALL * room))
    evidence = (
        f"at the start's angle over {quantity(float(width[0]), 'm', 2)}, at other angles over up to "
        f"{quantity(float(width.max()), 'm', 2)}, {per_cent(float(width.max()) / room)} of their room; over "
        f"{per_cent(SMALL)} or more at {per_cent(share)} of all angles"
    )
    return decide(share, 0.05, 0.5, evidence)


def sensitive(runs: Runs, model: str, claim: Mapping[str, Any]) -> Decision:
    """Decide whether runs from starts close by become as different as any two cycles: what chaos needs.

    At the strobes of the later cycles the distance of the perturbed run is compared with that of points drawn
    from the Poincaré map at random, whose mean square is twice the map's variance. The map itself must not
    shrink with the tolerance, or what parts the runs is the solver.
    """
    scene = claim["scene"]
    base, perturbed, finer = (
        _later(runs.by_cycle(run, "slider_x"))
        for run in (runs.long[scene, model], runs.perturbed[model], runs.finer[model])
    )
    spread, of_finer = float(np.std(base[:, 0])), float(np.std(finer[:, 0]))
    apart = base - perturbed
    drawn = np.sqrt(2.0) * spread
    distance = float(np.sqrt(np.mean(apart[:, 0] ** 2)))
    clearance = float(load_scene(scene).data["clearance"]["slider"])
    evidence = (
        f"started {quantity(PERTURBATION * clearance, 'm', 2)} apart; at the strobes of the later cycles "
        f"{quantity(distance, 'm', 2)}, two points of the map {quantity(drawn, 'm', 2)}; within a cycle "
        f"up to {quantity(float(np.abs(apart).max()), 'm', 2)}; the map at a tighter tolerance is "
        f"{number(of_finer / spread if spread else 1.0, 2)} times as wide"
    )
    same_width = 0.5 * spread <= of_finer <= 2.0 * spread
    alike = distance / drawn if drawn else 0.0
    return decide(alike if same_width or alike < 0.5 else 0.25, 0.01, 0.5, evidence)


def periodic(runs: Runs, model: str, claim: Mapping[str, Any]) -> Decision:
    """Decide whether a channel repeats from cycle to cycle, but for a small part of its range."""
    cycles = _later(runs.by_cycle(runs.long[claim["scene"], model], claim["channel"]))
    spread = float(np.ptp(cycles, axis=0).max()) / float(np.ptp(cycles))
    return decide(-spread, -2 * SMALL, -SMALL, f"cycles differ by up to {per_cent(spread)} of the range")


def two_codes(runs: Runs, model: str, claim: Mapping[str, Any]) -> Decision:
    """Decide whether the two models' errors are consistent in the second cycle."""
    other = next(name for name in MODELS if name != model)
    scene = claim["scene"]
    within = second(runs.short[scene, model][0])
    shares, parts = [], []
    for channel in CHANNELS:
        mine, theirs = (runs.errors(scene, name, channel)[within] for name in (model, other))
        shares.append(float(np.sqrt(np.mean((mine - theirs) ** 2) / np.mean(mine**2))))
        parts.append(f"{channel} {per_cent(shares[-1])}")
    evidence = f"difference of the codes, of the error's own size: {', '.join(parts)}"
    return decide(-max(shares), -0.5, -0.1, evidence)


def _at_the_bottom(runs: Runs, scene: str, model: str, channel: str) -> Peak:
    return runs.of_two_cycles(scene, model).peak(channel, *_bottom(runs, scene, model))


def _bottom(runs: Runs, scene: str, model: str) -> tuple[float, float]:
    """Return from when to when, s, the two cycles are near their second lowest point."""
    ideal = runs.ideal[scene, model]
    within = second(ideal)
    y = np.where(within, ideal.values("slider_y"), np.inf)
    period = float(ideal.time[-1]) / 2
    # The printed time is one at 150 rpm, and approximate: the lowest point itself is taken.
    width = BOTTOM * period / load_scene("ideal").period
    lowest = float(ideal.time[y.argmin()])
    return lowest - width, lowest + width


def _later(cycles: Array) -> Array:
    return cycles[int(SETTLED * len(cycles)) :]
