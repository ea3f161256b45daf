"""Check whether the reference misses a contact: indentation of corners and journal outside of contacts.

Random runs of two cycles: all formulations and contact laws, tolerances and everything that a contact depends
on. Every accepted step of the compiled integrator is computed again and looked at in 64 points
(`corner_depth_steps`); runs by scipy's solvers are judged by a dense table against their table of contacts.

A second population, the shipped 0.2 mm scene from random starts at 150 to 300 rpm at tolerance 1e-9, is where
steps of free flight are long and grazing contacts frequent. Measured there on commit f248ffa, which looked
for the turning point of a gap only where the ends of a step say that there is one: of 240 runs (seed 0) 25
had an open corner in its wall, by up to 4.5e-7 m; at touches 51 were deeper than 1e-11 m, by up to 1.3e-10 m,
as the step taken again up to a touch does not end just where the longer step's dense output had it.

    python benchmarks/corner_depths.py [--runs 2000] [--grazing 240] [--scipy 40] [--limit 50000] [--jobs 1]

Exit code 1 if anything is deeper than it may be.
"""

import argparse
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import NamedTuple
from unittest.mock import patch

import numpy as np
from corner_depth_runs import Draw, grazing_runs, random_runs, scipy_runs
from corner_depth_steps import CLOSED, NOT_REPRODUCED, OUTSIDE, TIME, TOUCHING, VIOLATIONS, WORST, check

from comparison.formatting import table
from comparison.scene import Scene, load_scene
from reference_model import integrate, simulation

BOUND = 1e-11
"""m; far above the rounding of a gap, 1e-16 m, and far below the depth of any contact, 1e-7 m and more."""
LIMIT = 50_000
"""Attempted steps and switches of a run; a longer run is stopped and evaluated up to there. With 100,000 half
of the random runs finish; a sticking pin with clearance is stiff and needs more.
"""
SCIPY_FACTOR = 10.0
"""Depth outside a contact, over the tolerance (m and rad)."""
SCIPY_LIMIT = 30_000
"""Steps and switches of a run by scipy, some 0.5 ms each."""
OF_SIDES = "foundation"
"""The law whose contacts are of both corners of a side."""
FINISHED, STOPPED, REFUSED = "finished", "stopped by the checker", "refused"
JUDGED = (FINISHED, STOPPED)
"""Runs that the reference itself stops have no result to check."""
STATUS = {
    integrate.REACHED: FINISHED,
    integrate.STEP_TOO_SMALL: "step too small",
    integrate.NOT_FINITE: "not finite",
    integrate.STEP_LIMIT: STOPPED,
    integrate.CHATTER: "chatter",
}


class Worst(NamedTuple):
    """Steps outside the bound, the largest value of all (m), and when (s)."""

    steps: int = 0
    value: float = 0.0
    time: float = 0.0


class Found(NamedTuple):
    """A run's result: open contacts in their wall, the same in the step of a touch, closed ones off it."""

    status: str
    steps: int
    missed: Worst = Worst()
    late: Worst = Worst()
    held: Worst = Worst()

    @property
    def too_deep(self) -> bool:
        """Whether an open contact is deeper than it may be, in a run that has a result."""
        return self.status in JUDGED and self.missed.steps + self.late.steps > 0


def followed(draw: Draw, limit: int = LIMIT) -> Found:
    """Check a run of the compiled integrator."""
    run = check(load_scene(draw.scene, draw.values), BOUND, limit)
    if run.status == NOT_REPRODUCED:
        raise RuntimeError(f"run {draw.number}: a step could not be reproduced: {draw.values}")
    rows = (run.found[row] for row in (OUTSIDE, TOUCHING, CLOSED))
    worst = (Worst(int(row[VIOLATIONS]), float(row[WORST]), float(row[TIME])) for row in rows)
    return Found(STATUS[run.status], run.steps, *worst)


def tabulated(draw: Draw) -> Found:
    """Check a run by its table: corners from the slider's x and angle, contacts from its events."""
    scene = load_scene(draw.scene, draw.values)
    try:
        with patch.object(simulation, "SCIPY_STEPS_PER_CYCLE_LIMIT", SCIPY_LIMIT):
            result = simulation.simulate(scene.data)
    except ValueError:  # a tolerance too coarse for the clearance
        return Found(REFUSED, 0)
    times, events = result.columns["time"], result.events
    worst, violations = Worst(), 0
    for corner, depth in depths(scene, result.columns).items():
        mine = [f"{end}{corner[1]}" for end in "lu"] if draw.values["contact.law"] == OF_SIDES else [corner]
        rows = np.isin(events["corner"], mine)
        depth[closed(times, events["start"][rows], events["end"][rows])] = 0.0
        violations += int(np.count_nonzero(depth > SCIPY_FACTOR * draw.values["solver.reference.tolerance"]))
        if depth.max(initial=0.0) > worst.value:
            worst = Worst(0, float(depth.max()), float(times[depth.argmax()]))
    status = {"success": FINISHED, "work-limit": STOPPED}.get(result.status, result.status)
    return Found(status, int(result.provenance["counters"]["steps"]), worst._replace(steps=violations))


def depths(scene: Scene, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return how deep (m) each corner is in its wall, at all samples."""
    slider, x, angle = scene.data["mechanism"]["slider"], columns["slider_x"], columns["slider_angle"]
    across, along = slider["width"] / 2 * np.cos(angle), slider["length"] / 2 * np.sin(angle)
    room = slider["width"] / 2 + scene.data["clearance"]["slider"]
    right, left = scene.data["mechanism"]["guide_x"] + room, scene.data["mechanism"]["guide_x"] - room
    return {
        "ll": left - (x - across + along),
        "lr": x + across + along - right,
        "ul": left - (x - across - along),
        "ur": x + across - along - right,
    }


def closed(times: np.ndarray, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return which times are within a contact, its ends included."""
    # A row more at the end than at the start: the sample is between. Contacts of one corner do not overlap.
    begun = np.searchsorted(np.sort(starts), times + 1e-12, side="right")
    ended = np.searchsorted(np.sort(ends), times - 1e-12, side="left")
    return np.asarray(begun > ended)


def work(what: str, judge: Callable[[Draw], Found], draws: Sequence[Draw], jobs: int) -> list[Found]:
    """Check all runs of a population."""
    begun, found = time.monotonic(), []
    with ProcessPoolExecutor(jobs) as pool:
        for draw, one in zip(draws, pool.map(judge, draws), strict=True):
            found.append(one)
            said = f"{what}: {len(found)}/{len(draws)}, {time.monotonic() - begun:.0f} s"
            if one.too_deep:
                deepest = max(one.missed, one.late, key=lambda worst: worst.value)
                said += f"; run {draw.number}: {deepest.value:.1e} m at {deepest.time:.6f} s, {draw.labels}"
            if one.too_deep or len(found) % max(1, len(draws) // 20) == 0:
                print(said, file=sys.stderr, flush=True)
    return found


def report(what: str, draws: Sequence[Draw], found: Sequence[Found]) -> None:
    """Print what came of a population, in all and by each label."""
    print(f"\n{what}: {len(found)} runs, {sum(one.steps for one in found)} accepted steps")
    print(", ".join(f"{n} {status}" for status, n in Counter(one.status for one in found).items()))
    head = ["of", "", "runs", "in the wall, open", "deepest (m)", "at its touch", "deepest (m)"]
    groups = [(key, value) for key in draws[0].labels for value in sorted({d.labels[key] for d in draws})]
    rows = []
    for key, value in [("all", ""), *groups]:
        some = [
            one
            for draw, one in zip(draws, found, strict=True)
            if draw.labels.get(key, "") == value and one.status in JUDGED
        ]
        rows.append([key, value, str(len(some))])
        for worst in ([getattr(one, part) for one in some] for part in ("missed", "late", "held")):
            rows[-1] += [str(sum(one.steps > 0 for one in worst))]
            rows[-1] += [f"{max((one.value for one in worst), default=0.0):.1e}"]
    print(f"\n{table([*head, 'off the wall, closed', 'farthest (m)'], rows)}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    defaults = {"runs": 2000, "grazing": 240, "scipy": 40, "limit": LIMIT, "seed": 0, "jobs": 1}
    for name, default in defaults.items():
        parser.add_argument(f"--{name}", type=int, default=default)
    options = parser.parse_args()
    begun, wrong = time.monotonic(), 0
    compiled = partial(followed, limit=options.limit)
    for what, judge, draws in (
        ("grazing", compiled, grazing_runs(options.grazing, options.seed)),
        ("random", compiled, random_runs(options.runs, options.seed)),
        ("scipy", tabulated, scipy_runs(options.scipy, options.seed)),
    ):
        if drawn := list(draws):
            found = work(what, judge, drawn, options.jobs)
            report(what, drawn, found)
            wrong += sum(one.too_deep for one in found)
    print(f"\n{time.monotonic() - begun:.0f} s")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
