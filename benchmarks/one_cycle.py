"""One crank cycle at 150 rpm, 0.2 mm: the reference against scipy's DOP853 and against Exudyn.

scipy's DOP853 integrates the same compiled right-hand side with the same events (each ends the solver's run,
and the next begins there); Exudyn's five bodies do the same scene at about equal error. The runs are
interleaved on one core, so a drifting machine moves all alike; what counts is the ratio of the medians.

    python benchmarks/one_cycle.py [--rounds 5] [--exudyn-step 1e-6]
"""

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq

import exudyn_model
import reference_model
from comparison.scene import load_scene
from reference_model.events import PULL, contact_state, step_may_switch, switching_value
from reference_model.forces import CLIPPED, CONTACTS, GAP, MEMORY, REGIME, SLIP, no_contacts
from reference_model.formulations import right_hand_side, state_size
from reference_model.friction import regime_bounds
from reference_model.parameters import Formulation
from reference_model.progress import begin, switch
from reference_model.reading import read_parameters
from reference_model.start import start

SCENE = load_scene("150rpm-0.2mm", {"drive.cycles": 1.0, "output.groups": []})


def by_scipy(scene: dict[str, Any], rtol: float, atol: float) -> np.ndarray:
    """Return slider x at the sample times, integrated by scipy's DOP853 from event to event."""
    p = read_parameters(scene)
    c, y0 = start(p, Formulation.SLIDER)
    progress = begin(c, y0, 1e-6)
    size, modes = state_size(c), progress.modes
    dy, contacts, full = np.empty(size), no_contacts(), np.zeros(size)
    times = np.arange(round(p.cycles * p.samples_per_cycle) + 1) * (p.period / p.samples_per_cycle)
    states = np.empty((times.size, 4))

    def derivative(t: float, y: np.ndarray) -> np.ndarray:
        full[:4] = y
        right_hand_side(c, t, full, modes, dy, contacts)
        return dy[:4].copy()

    def contacts_at(t: float, y: np.ndarray) -> np.ndarray:
        derivative(t, y)
        return contacts.copy()

    t, y, filled = 0.0, y0.copy(), 0
    while t < times[-1]:
        solver = DOP853(derivative, t, y, times[-1], rtol=rtol, atol=atol, max_step=p.period / 50)
        event = None
        while solver.status == "running" and event is None:
            before = contacts_at(solver.t, solver.y)
            solver.step()
            after = contacts_at(solver.t, solver.y)
            dense = solver.dense_output()
            end = solver.t
            if step_may_switch(c, modes, before, after):
                event = first_event(c, modes, after, solver.t_old, solver.t, dense)
                end = event[0] if event else end
            last = np.searchsorted(times, end, side="right" if end == times[-1] else "left")
            for i in range(filled, last):
                states[i] = dense(times[i])
            filled = max(filled, last)
            t, y = end, dense(end) if event else solver.y
        if event:
            progress.y[:4] = y
            switch(c, t, event[1], event[2], contacts_at(t, y), progress)
            progress.counters[:] = 0
    return states


def first_event(c: Any, modes: np.ndarray, after: np.ndarray, t0: float, t1: float, dense: Any) -> Any:
    """Return time, kind and contact of the first mode that ends in a step, or None."""
    found = []
    for k in range(CONTACTS):
        candidates = [(GAP, 0.0, (after[GAP, k] < 0.0) != (modes[MEMORY, k] > 0.0))]
        if modes[MEMORY, k] > 0.0:
            pulling = modes[MEMORY, k] - c.C * after[1, k] < 0.0
            candidates.append((PULL, 0.0, pulling != (modes[CLIPPED, k] > 0.0)))
            lower, upper = regime_bounds(c, int(modes[REGIME, k]))
            if not lower <= after[SLIP, k] <= upper:
                candidates.append((SLIP, upper if after[SLIP, k] > upper else lower, True))
        for kind, bound, crossed in candidates:
            if not crossed:
                continue

            def value(t: float, kind: int = kind, k: int = k, bound: float = bound) -> float:
                return float(switching_value(c, kind, k, bound, t, dense(t), modes))

            lo, hi = value(t0), value(t1)
            found.append((brentq(value, t0, t1, xtol=1e-15) if lo * hi < 0.0 else t1, kind, k))
    return min(found, default=None)


def timed(run: Callable[[], Any]) -> tuple[float, Any]:
    started = time.perf_counter()
    result = run()
    return time.perf_counter() - started, result


def slider_x(states: np.ndarray, p: Any) -> np.ndarray:
    c, _ = start(p, Formulation.SLIDER)
    times = np.arange(states.shape[0]) * (p.period / p.samples_per_cycle)
    gaps = [contact_state(c, 0, t, s)[0] for t, s in zip(times, states, strict=True)]
    return np.array(gaps) + c.wall_left - corner_x(c, states)


def corner_x(c: Any, states: np.ndarray) -> np.ndarray:
    return -np.cos(states[:, 1]) * c.half_width + np.sin(states[:, 1]) * c.half_length


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--exudyn-step", type=float, default=1e-6)
    options = parser.parse_args()
    p = read_parameters(SCENE.data)
    exact = reference_model.simulate(SCENE.with_values({"solver.reference.tolerance": 1e-13}).data).columns

    def reference(tolerance: float) -> Callable[[], np.ndarray]:
        data = SCENE.with_values({"solver.reference.tolerance": tolerance}).data
        return lambda: reference_model.simulate(data).columns["slider_x"]

    exudyn_scene = SCENE.with_values({"solver.exudyn.step": options.exudyn_step}).data
    runs: dict[str, Callable[[], np.ndarray]] = {
        "reference, tolerance 1e-9": reference(1e-9),
        "reference, tolerance 1e-8": reference(1e-8),
        "scipy DOP853, same equations, rtol 1e-7": lambda: slider_x(by_scipy(SCENE.data, 1e-7, 1e-10), p),
        f"Exudyn, five bodies, step {options.exudyn_step:g} s": lambda: exudyn_model.simulate(
            exudyn_scene
        ).columns["slider_x"],
    }
    errors = {name: np.abs(run() - exact["slider_x"]).max() for name, run in runs.items()}  # and warms up
    seconds: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(options.rounds):
        for name, run in runs.items():
            seconds[name].append(timed(run)[0])
    medians = {name: statistics.median(values) for name, values in seconds.items()}
    unit = medians["reference, tolerance 1e-9"]
    print("| one cycle, 150 rpm, 0.2 mm | largest error of x (m) | median time (ms) | min (ms) | ratio |")
    print("|---|---|---|---|---|")
    for name, median in medians.items():
        print(
            f"| {name} | {errors[name]:.1e} | {median * 1e3:.1f} | {min(seconds[name]) * 1e3:.1f} "
            f"| {median / unit:.1f} |"
        )


if __name__ == "__main__":
    main()
