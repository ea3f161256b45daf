"""Five bodies are built from lists: a slider-crank whose guide has clearance, and any direction."""

import cmath
import math

import numpy as np
import pytest

from exudyn_model.five_bodies.settings import Settings
from exudyn_model.five_bodies.solver import run_system
from exudyn_model.five_bodies.system import Body, Drive, Pin, SliderContact, System
from exudyn_model.laws import Law

CRANK, ROD, OMEGA, START = 0.1, 0.4, 2 * math.pi, 0.3
STEEL = Law(0.0, 2e-4, 4.8e9, 1.5, 0.1425, 1e-4, 0.15, 1e-4, 1e-3, half_width=0.025, half_length=0.035)


def slider_crank(turned):
    """A slider-crank in a guide with clearance, turned from the x axis; it starts on the centre line."""
    rod = -math.asin(CRANK / ROD * math.sin(START))
    spin = -CRANK * OMEGA * math.cos(START) / (ROD * math.cos(rod))
    u1, u2, turn = (cmath.exp(1j * angle) for angle in (START, rod, turned))
    places = [CRANK / 2 * u1, CRANK * u1 + ROD / 2 * u2, complex((CRANK * u1 + ROD * u2).real)]
    tip = 1j * OMEGA * CRANK * u1
    rates = [tip / 2, tip + 0.5j * spin * ROD * u2, complex((tip + 1j * spin * ROD * u2).real)]
    across = math.pi / 2  # the slider's own x axis
    motion = zip(places, (START, rod, across), rates, (OMEGA, spin, 0.0), strict=True)
    bodies = [
        Body(0.2, 1e-3, ((p * turn).real, (p * turn).imag, a + turned), ((r * turn).real, (r * turn).imag, w))
        for p, a, r, w in motion
    ]
    pins = [Pin("O", -1, (0.0, 0.0), 0, (-CRANK / 2, 0.0)), Pin("A", 0, (CRANK / 2, 0.0), 1, (-ROD / 2, 0.0))]
    pins.append(Pin("B", 1, (ROD / 2, 0.0), 2, (0.0, 0.0)))
    contact = SliderContact(2, (0.0, 0.0), across + turned, STEEL)
    return System(bodies, pins, [], [contact], Drive(0, OMEGA), 2, 0.0)


def run(system, method):
    """Run a fifth of a revolution in steps of 5e-6 s in contacts."""
    settings = Settings(method, 1e-3, 200, 1.0, False, 200, 200, False, 1e-10, 1, 1e-7)
    recorder, _, outcome = run_system(system, settings)
    assert outcome.status == "success", outcome.remedy
    return recorder


@pytest.mark.parametrize("method", ["generalized-alpha", "trapezoidal-index2"])
def test_turned_with_its_guide_it_moves_as_before(method):
    """From a start on the centre line: the first impacts, by angles of all sizes."""
    upright = run(slider_crank(0.0), method)
    for turned in (1.0, -math.pi / 2, 2.5):
        other = run(slider_crank(turned), method)
        both = [one.columns(("slider_x", "slider_y")) for one in (upright, other)]
        place = [columns["slider_x"] + 1j * columns["slider_y"] for columns in both]
        events = upright.event_table(), other.event_table()
        assert len(events[0]["start"]) >= 2
        assert list(events[1]["corner"]) == list(events[0]["corner"])
        # Newton's tolerance, which impacts magnify
        np.testing.assert_allclose(events[1]["start"], events[0]["start"], atol=1e-6)
        np.testing.assert_allclose(place[1] * cmath.exp(-1j * turned), place[0], atol=1e-8)


def test_what_does_not_fit_its_joints_is_refused():
    system = slider_crank(0.0)
    system.bodies[1] = system.bodies[1]._replace(position=(0.3, 0.0, 0.0))
    with pytest.raises(AssertionError, match="do not fit the joints"):
        run(system, "generalized-alpha")
