"""Another planar linkage, a slider-crank with clearance in its guide, from the lists of either model."""

import math

import numpy as np

from comparison.scene import load_scene
from exudyn_model.five_bodies.settings import Settings
from exudyn_model.five_bodies.solver import run_system
from exudyn_model.five_bodies.system import Body, Drive, Pin, SliderContact, System
from exudyn_model.parameters import Contact
from reference_model import integrate
from reference_model.contact import TAIL
from reference_model.events import RECORDED
from reference_model.multiplier import FRAME, assemble
from reference_model.parameters import read_parameters
from reference_model.recording import PURPOSE, SAMPLE, SLIDER_FROM

CRANK, ROD, OMEGA, ANGLE, GRAVITY = 0.05, 0.3, 12.0, 0.3, 9.81
WIDTH, LENGTH, CLEARANCE = 0.05, 0.07, 2e-4
BODIES = [(0.1, 2e-5), (0.2, 1.5e-3), (0.3, 5e-5)]
"""kg, kg m^2."""
END, SAMPLES = 0.06, 300


def start():
    """Places, angles and their rates of the three bodies; the guide is the y axis, the slider on its line."""
    x, y = CRANK * math.cos(ANGLE), CRANK * math.sin(ANGLE)
    vx, vy = -OMEGA * y, OMEGA * x
    rod = math.acos(-x / ROD)
    w = vx / (ROD * math.sin(rod))
    reach, rate = ROD * math.sin(rod), ROD * w * math.cos(rod)
    places = [(x / 2, y / 2, ANGLE), (x / 2, y + reach / 2, rod), (0.0, y + reach, 1e-4)]
    return places, [(vx / 2, vy / 2, OMEGA), (vx / 2, vy + rate / 2, w), (0.0, vy + rate, 0.1)]


def scene_law():
    return read_parameters(load_scene("150rpm-0.2mm").data).law


def by_reference(tolerance):
    """x and angle of the slider at the samples."""
    law = scene_law()._replace(
        half_width=WIDTH / 2, half_length=LENGTH / 2, corner_mass=BODIES[2][1] / (LENGTH / 2) ** 2,
        wall_left=-WIDTH / 2 - CLEARANCE, wall_right=WIDTH / 2 + CLEARANCE,
    )  # fmt: skip
    model = assemble(
        bodies=BODIES,
        pins=[(0, (-CRANK / 2, 0.0), FRAME, (0.0, 0.0)), (1, (-ROD / 2, 0.0), 0, (CRANK / 2, 0.0)),
              (2, (0.0, 0.0), 1, (ROD / 2, 0.0))],
        guides=[],
        drive=(0, OMEGA, ANGLE),
        slider=(2, True),
        gravity=GRAVITY,
    )  # fmt: skip
    times = np.linspace(0.0, END, SAMPLES + 1)
    instants = np.array([[*times[:-1], np.inf], np.full(SAMPLES + 1, SAMPLE)])
    run, work = integrate.new_run(np.ravel(start()), 1e-6, instants, 20_000)
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
    assert difference.max() > 0.0
