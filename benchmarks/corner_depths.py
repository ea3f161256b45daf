"""Search for contacts that the reference misses: indentation of corners and journal outside of contacts.

Random runs of two cycles: all formulations and contact laws, tolerances and everything that a contact depends
on. Every accepted step of the compiled integrator is computed again and looked at in 64 points
(`corner_depth_steps`); runs by scipy's solvers are judged by a dense table against their table of contacts.

A second population, the shipped 0.2 mm scene from random starts at 150 to 300 rpm at tolerance 1e-9, is where
steps of free flight are long and grazing contacts frequent.

    python benchmarks/corner_depths.py [--runs 2000] [--grazing 240] [--scipy 40] [--limit 50000] [--jobs 1]

Exit code 1 if anything is deeper than it may be.
"""

import argparse
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
import pandas as pd
from corner_depth_steps import CLOSED, NOT_REPRODUCED, OUTSIDE, TIME, TOUCHING, VIOLATIONS, WORST, check

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
CYCLES = 2.0
TOLERANCES_OF_SCIPY = {"BDF": 1e-8, "Radau": 1e-8, "LSODA": 1e-9, "scipy-DOP853": 1e-9}
"""The finest of each; BDF and Radau take 0.5 ms a step and a thousand steps more for every decade."""
SCIPY_CYCLES = 0.25
SAMPLES = 40_000
"""Of a cycle of scipy's: at 150 rpm 1e-5 s apart, a tenth of an elastic contact of steel."""
FORMULATIONS = {
    "minimal": {},
    "multiplier": {"solver.reference.formulation": "multiplier"},
    "pin": {"joints.slider": "ideal", "joints.crank_pin": "clearance"},
    "both": {"joints.crank_pin": "clearance"},
}
LAWS = ("hertz-corners", "paper-switching", "foundation", "adams-impact")
FINISHED, STOPPED, REFUSED = "finished", "stopped by the checker", "refused"
RESULTS = (FINISHED, STOPPED)
"""Runs that the reference itself stops have no result to check."""
STATUS = {
    integrate.REACHED: FINISHED,
    integrate.STEP_TOO_SMALL: "step too small",
    integrate.NOT_FINITE: "not finite",
    integrate.STEP_LIMIT: STOPPED,
    integrate.CHATTER: "chatter",
}


class Draw(NamedTuple):
    """A run: its labels in the counts, and the scene's name and changes."""

    number: int
    labels: dict[str, str]
    scene: str
    changes: dict[str, Any]


def contacts(rng: np.random.Generator) -> dict[str, Any]:
    """Draw everything that a contact depends on: start, speed, clearances, material, friction, gravity."""
    clearance = 10.0 ** rng.uniform(-5.0, -3.0)
    # Of the clearance; one in ten starts on the centre line, one in twenty a little inside a wall.
    offset = rng.uniform(-1.0, 1.0) * rng.choice([0.0, 1.0], p=[0.1, 0.9])
    if rng.uniform() < 0.05:
        offset = 1.001 * rng.choice([-1.0, 1.0])
    # A corner is off by half the length of 0.07 m times the angle: mostly within the clearance that is left.
    angle = rng.uniform(-1.0, 1.0) * max(0.0, 1.0 - abs(offset)) * clearance / 0.035
    return {
        "drive.cycles": CYCLES,
        "drive.speed_rpm": float(rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(1.0, 3.0)),
        "mechanism.crank_angle_deg": float(rng.uniform(0.0, 360.0)),
        "clearance.slider": float(clearance),
        "clearance.crank_pin": float(10.0 ** rng.uniform(-5.0, -3.3)),
        "initial.slider_offset": float(offset * clearance),
        "initial.slider_angle": float(angle * rng.choice([0.0, 1.0])),
        "initial.slider_vx": float(rng.normal(0.0, 0.05) * rng.choice([0.0, 1.0])),
        "initial.slider_omega": float(rng.normal(0.0, 1.0) * rng.choice([0.0, 1.0])),
        "contact.youngs_modulus": float(10.0 ** rng.uniform(8.0, 12.0)),
        "contact.poisson": float(rng.uniform(0.0, 0.49)),
        "contact.restitution": float(rng.choice([0.0, 1.0, rng.uniform()], p=[0.1, 0.1, 0.8])),
        "contact.corner_radius": float(10.0 ** rng.uniform(-4.0, -1.0)),
        "friction.coefficient": float(rng.choice([0.0, rng.uniform()], p=[0.2, 0.8])),
        "environment.gravity": float(rng.choice([0.0, 9.81, -9.81, rng.uniform(-30.0, 30.0)])),
        "contact.damping": float(10.0 ** rng.uniform(0.0, 4.0)),
        "contact.damping_depth": float(10.0 ** rng.uniform(-7.0, -3.0)),
    }


def random_runs(count: int, seed: int) -> Iterator[Draw]:
    """Draw runs of the compiled integrator."""
    for number in range(count):
        rng = np.random.default_rng([seed, 0, number])
        name = str(rng.choice(list(FORMULATIONS)))
        law = str(rng.choice(LAWS)) if name != "pin" else "journal"
        exponent = rng.uniform(-12.0, -8.0)
        values = contacts(rng) | FORMULATIONS[name] | {"solver.reference.tolerance": float(10.0**exponent)}
        if name != "pin":
            values["contact.law"] = law
        labels = {"formulation": name, "law": law, "tolerance": f"1e{int(np.floor(exponent)):+d}.."}
        yield Draw(number, labels, "paper", values)


def grazing_runs(count: int, seed: int) -> Iterator[Draw]:
    """Draw starts and speeds of the shipped scene of 0.2 mm, everything else as shipped."""
    for number in range(count):
        rng = np.random.default_rng([seed, 1, number])
        values = {
            "drive.cycles": CYCLES,
            "drive.speed_rpm": float(rng.uniform(150.0, 300.0)),
            "initial.slider_offset": float(rng.uniform(-2e-4, 2e-4)),
            "solver.reference.tolerance": 1e-9,
        }
        yield Draw(number, {}, "150rpm-0.2mm", values)


def scipy_runs(count: int, seed: int) -> Iterator[Draw]:
    """Draw runs of scipy's solvers, in turn; corners only."""
    methods = list(TOLERANCES_OF_SCIPY)
    for number in range(count):
        rng = np.random.default_rng([seed, 2, number])
        method = methods[number % len(methods)]
        name = str(rng.choice(["minimal", "multiplier", "both"]))
        law = str(rng.choice([law for law in LAWS if law != "paper-switching"]))
        exponent = rng.uniform(np.log10(TOLERANCES_OF_SCIPY[method]), -6.0)
        values = contacts(rng) | FORMULATIONS[name] | {
            "contact.law": law,
            "drive.cycles": SCIPY_CYCLES,
            "output.samples_per_cycle": SAMPLES,
            "output.groups": ["corners"],
            "solver.reference.method": method,
            "solver.reference.tolerance": float(10.0**exponent),
        }  # fmt: skip
        yield Draw(number, {"method": method, "formulation": name, "law": law}, "paper", values)


class Breach(NamedTuple):
    """Steps outside the bound, the largest value of all (m), and its time (s)."""

    steps: int = 0
    value: float = 0.0
    time: float = 0.0


PARTS = {"open": "in the wall, open", "touch": "at its touch", "closed": "off the wall, closed"}


class Finding(NamedTuple):
    """A run's result: open contacts in their wall, the same in the step of a touch, closed ones off it."""

    status: str
    steps: int
    open: Breach = Breach()
    touch: Breach = Breach()
    closed: Breach = Breach()

    @property
    def too_deep(self) -> bool:
        """True if an open contact is deeper than it may be, in a run that has a result."""
        return self.status in RESULTS and self.open.steps + self.touch.steps > 0


def check_steps(draw: Draw, limit: int = LIMIT) -> Finding:
    """Check a run of the compiled integrator."""
    run = check(load_scene(draw.scene, draw.changes), BOUND, limit)
    if run.status == NOT_REPRODUCED:
        raise RuntimeError(f"run {draw.number}: a step could not be reproduced: {draw.changes}")
    rows = (run.depths[row] for row in (OUTSIDE, TOUCHING, CLOSED))
    worst = (Breach(int(row[VIOLATIONS]), float(row[WORST]), float(row[TIME])) for row in rows)
    return Finding(STATUS[run.status], run.steps, *worst)


def check_table(draw: Draw) -> Finding:
    """Check a run by its table: corners from the slider's x and angle, contacts from its events."""
    scene = load_scene(draw.scene, draw.changes)
    try:
        with patch.object(simulation, "SCIPY_STEPS_PER_CYCLE_LIMIT", SCIPY_LIMIT):
            result = simulation.simulate(scene.data)
    except ValueError:  # a tolerance too coarse for the clearance
        return Finding(REFUSED, 0)
    times, events = result.columns["time"], result.events
    worst, violations = Breach(), 0
    for corner, depth in depths(scene, result.columns).items():
        # A side of a foundation has one contact, of both its corners.
        whole_side = draw.changes["contact.law"] == "foundation"
        rows = np.isin(events["corner"], [f"{end}{corner[1]}" for end in "lu"] if whole_side else [corner])
        depth[in_contact(times, events["start"][rows], events["end"][rows])] = 0.0
        violations += int(np.count_nonzero(depth > SCIPY_FACTOR * draw.changes["solver.reference.tolerance"]))
        if depth.max(initial=0.0) > worst.value:
            worst = Breach(0, float(depth.max()), float(times[depth.argmax()]))
    status = {"success": FINISHED, "work-limit": STOPPED}.get(result.status, result.status)
    return Finding(status, int(result.provenance["counters"]["steps"]), worst._replace(steps=violations))


def depths(scene: Scene, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the depth (m) of each corner in its wall, at all samples."""
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


def in_contact(times: np.ndarray, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return a mask of the times within a contact, its ends included."""
    # A row more at the end than at the start: the sample is between. Contacts of one corner do not overlap.
    start_counts = np.searchsorted(np.sort(starts), times + 1e-12, side="right")
    end_counts = np.searchsorted(np.sort(ends), times - 1e-12, side="left")
    return np.asarray(start_counts > end_counts)


def work(title: str, judge: Callable[[Draw], Finding], draws: Sequence[Draw], jobs: int) -> list[Finding]:
    """Check all runs of a population."""
    start, results = time.monotonic(), []
    with ProcessPoolExecutor(jobs) as pool:
        for draw, one in zip(draws, pool.map(judge, draws), strict=True):
            results.append(one)
            line = f"{title}: {len(results)}/{len(draws)}, {time.monotonic() - start:.0f} s"
            if one.too_deep:
                deepest = max(one.open, one.touch, key=lambda worst: worst.value)
                line += f"; run {draw.number}: {deepest.value:.1e} m at {deepest.time:.6f} s, {draw.labels}"
            if one.too_deep or len(results) % max(1, len(draws) // 20) == 0:
                print(line, file=sys.stderr, flush=True)
    return results


def report(title: str, draws: Sequence[Draw], results: Sequence[Finding]) -> None:
    """Print the counts of a population's runs by kind of contact, and largest distances: in all, by label."""
    print(f"\n{title}: {len(results)} runs, {sum(one.steps for one in results)} accepted steps")
    print(", ".join(f"{n} {status}" for status, n in Counter(one.status for one in results).items()))
    rows: list[dict[str, Any]] = []
    for draw, one in zip(draws, results, strict=True):
        if one.status in RESULTS:
            rows.append(draw.labels | {"all": title, "runs": 1})
            for part, heading in PARTS.items():
                worst: Breach = getattr(one, part)
                rows[-1] |= {heading: worst.steps > 0, f"{heading} (m)": worst.value}
    if not rows:
        return
    labels = ["all", *draws[0].labels]
    functions = {name: "max" if "(m)" in name else "sum" for name in rows[0] if name not in labels}
    for label in labels:
        print(f"\n{pd.DataFrame(rows).groupby(label).agg(functions).to_string()}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    defaults = {"runs": 2000, "grazing": 240, "scipy": 40, "limit": LIMIT, "seed": 0, "jobs": 1}
    for name, default in defaults.items():
        parser.add_argument(f"--{name}", type=int, default=default)
    options = parser.parse_args()
    start, count = time.monotonic(), 0
    compiled = partial(check_steps, limit=options.limit)
    for title, judge, draws in (
        ("grazing", compiled, grazing_runs(options.grazing, options.seed)),
        ("random", compiled, random_runs(options.runs, options.seed)),
        ("scipy", check_table, scipy_runs(options.scipy, options.seed)),
    ):
        if runs := list(draws):
            results = work(title, judge, runs, options.jobs)
            report(title, runs, results)
            count += sum(one.too_deep for one in results)
    print(f"\n{time.monotonic() - start:.0f} s")
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
