"""Another planar linkage, a slider-crank with clearance in its guide, from the lists of either model."""

import numpy as np
from listed_slider_crank import (
    BODIES,
    CLEARANCE,
    CRANK,
    GRAVITY,
    LENGTH,
    OMEGA,
    ROD,
    WIDTH,
    by_lists,
    start,
)

from comparison.scene import load_scene
from exudyn_model.five_bodies.settings import Settings
from exudyn_model.five_bodies.solver import run_system
from exudyn_model.five_bodies.system import Body, Drive, Pin, SliderContact, System
from exudyn_model.parameters import Contact
from reference_model import integrate
from reference_model.contact import TAIL
from reference_model.events import RECORDED
from reference_model.parameters import read_parameters
from reference_model.recording import PURPOSE, SAMPLE, SLIDER_FROM

END, SAMPLES = 0.06, 300


def scene_law():
    return read_parameters(load_scene("150rpm-0.2mm").data).law


def by_reference(tolerance):
    """x and angle of the slider at the samples."""
    model, law, y0 = by_lists(scene_law())
    times = np.linspace(0.0, END, SAMPLES + 1)
    instants = np.array([[*times[:-1], np.inf], np.full(SAMPLES + 1, SAMPLE)])
    run, work = integrate.new_run(y0, 1e-6, instants, 20_000)
    assert integrate.advance(model, law, run, work, END, END, tolerance, 0.01, 1000, 10**6) == 0
    assert run.nodes.y.shape[1] == 18 + TAIL
    rows = run.rows[: run.counters[RECORDED]]
    samples = rows[(rows[:, PURPOSE].astype(int) & SAMPLE) > 0]
    return samples[:, [SLIDER_FROM, SLIDER_FROM + 2]].T


def by_exudyn(step):
    """The same by Exudyn's five-body builder; also the corners that touched."""
    law = scene_law()
    contact = Contact(
        CLEARANCE, law.K, law.n, law.C, "frozen", law.speed_floor, law.c_f, law.v0, law.v1
    )  # fmt: skip
    system = System(
        [Body(*body, place, rate) for body, place, rate in zip(BODIES, *start(), strict=True)],
        [Pin("O", -1, (0.0, 0.0), 0, (-CRANK / 2, 0.0)), Pin("A", 0, (CRANK / 2, 0.0), 1, (-ROD / 2, 0.0)),
         Pin("B", 1, (ROD / 2, 0.0), 2, (0.0, 0.0))],
        [],
        [SliderContact(2, (0.0, 0.0), 0.0, WIDTH, LENGTH, contact)],
        Drive(0, OMEGA),
        2,
        GRAVITY,
    )  # fmt: skip
    interval = END / SAMPLES
    ticks = round(interval / step)
    # Index 2, where Newton's tolerance is absolute: index 3 leaves 2.5e-9 of the weights unbalanced
    settings = Settings(
        "trapezoidal-index2", interval, SAMPLES, 1.0, False, ticks, ticks, False, 1e-10, 1, 1e-8
    )
    recorder, _, outcome = run_system(system, settings)
    assert outcome.status == "success", outcome.remedy
    found = recorder.columns(("slider_x", "slider_angle"))
    return np.stack([found["slider_x"], found["slider_angle"]]), recorder.event_table()["corner"]


def test_both_models_agree_on_a_slider_crank_to_their_uncertainties() -> None:
    """Difference against what refinement moves either model by, largest so far: the rule of the verdicts."""
    exact, finer = by_reference(1e-10), by_reference(1e-12)
    five, corners = by_exudyn(2e-6)
    closer, _ = by_exudyn(1e-6)
    assert len(corners) >= 3
    scale = np.array([[CLEARANCE], [CLEARANCE / LENGTH]])
    moved = [np.maximum.accumulate(np.abs(a - b), axis=1) for a, b in ((exact, finer), (five, closer))]
    # A second-order method's error is 4/3 of what halving its step removes; round-off of x is some 1e-15 m
    u = np.hypot(moved[0], 4 / 3 * moved[1]) + 1e-14
    difference = np.abs(exact - five)
    assert (u <= 0.01 * scale).mean() >= 0.95
    assert (difference <= 2.0 * u).mean() >= 0.99
