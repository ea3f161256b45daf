"""Five bodies are built from lists: another linkage, a slider-crank, also with clearance in its guide."""

import cmath
import math

import numpy as np
import pytest

from exudyn_model.five_bodies.settings import Settings
from exudyn_model.five_bodies.solver import run_system
from exudyn_model.five_bodies.system import Body, Drive, Guide, Pin, SliderContact, System
from exudyn_model.parameters import Contact

CRANK, ROD, OMEGA, START = 0.1, 0.4, 2 * math.pi, 0.3
STEEL = Contact(2e-4, 4.8e9, 1.5, 0.1425, 1e-4, 0.15, 1e-4, 1e-3)


def along_guide(angle):
    """Position, velocity of the slider along the guide, and the rod's angle, at a crank's angle."""
    sine, cosine = np.sin(angle), np.cos(angle)
    reach = np.sqrt(ROD**2 - (CRANK * sine) ** 2)
    return (
        CRANK * cosine + reach,
        -CRANK * OMEGA * sine * (1 + CRANK * cosine / reach),
        -np.arcsin(CRANK / ROD * sine),
    )


def slider_crank(turned=0.0, clearance=False):
    """A slider-crank whose guide is turned from the x axis; its slider starts on the centre line."""
    x, v, rod = (float(value) for value in along_guide(START))
    spin = -CRANK * OMEGA * math.cos(START) / (ROD * math.cos(rod))
    u1, u2 = cmath.exp(1j * START), cmath.exp(1j * rod)
    places = [CRANK / 2 * u1, CRANK * u1 + ROD / 2 * u2, complex(x)]
    rates = [0.5j * OMEGA * CRANK * u1, 1j * OMEGA * CRANK * u1 + 0.5j * spin * ROD * u2, complex(v)]
    across = math.pi / 2 if clearance else 0.0  # the slider's own x axis
    motion = zip(places, (START, rod, across), rates, (OMEGA, spin, 0.0), strict=True)
    turn = cmath.exp(1j * turned)
    bodies = [
        Body(0.2, 1e-3, ((p * turn).real, (p * turn).imag, a + turned), ((r * turn).real, (r * turn).imag, w))
        for p, a, r, w in motion
    ]
    pins = [Pin("O", -1, (0.0, 0.0), 0, (-CRANK / 2, 0.0)), Pin("A", 0, (CRANK / 2, 0.0), 1, (-ROD / 2, 0.0))]
    pins.append(Pin("B", 1, (ROD / 2, 0.0), 2, (0.0, 0.0)))
    guides = [] if clearance else [Guide(2, 1, 0.0)]
    contacts = [SliderContact(2, (0.0, 0.0), across + turned, 0.05, 0.07, STEEL)] if clearance else []
    return System(bodies, pins, guides, contacts, Drive(0, OMEGA), 2, 0.0)


def run(system, method="trapezoidal-index2", samples=200, energy=True):
    """Run a fifth of a revolution in steps of 5e-6 s in contacts."""
    interval = 0.2 / samples
    ticks = round(interval / 5e-6)
    fixed = not system.contacts
    settings = Settings(method, interval, samples, 1.0, energy, ticks, ticks, fixed, 1e-10, 1, 1e-7)
    recorder, _, outcome = run_system(system, settings)
    assert outcome.status == "success", outcome.remedy
    return recorder


def test_ideal_it_follows_the_closed_form():
    computed = run(slider_crank()).columns(
        ("slider_x", "slider_y", "slider_vx", "reaction_B_y", "guide_force")
    )
    angle = START + OMEGA * np.linspace(0.0, 0.2, 201)
    x, v, _ = along_guide(angle)
    # Second order: (omega h)^2 / 12 = 8e-11 of a path of 0.2 m
    np.testing.assert_allclose(computed["slider_x"], x, atol=1e-9)
    np.testing.assert_allclose(computed["slider_vx"], v, atol=1e-8)
    np.testing.assert_allclose(computed["slider_y"], 0.0, atol=1e-9)
    # Only the rod and the guide press the slider, which does not move across
    np.testing.assert_allclose(computed["reaction_B_y"], -computed["guide_force"], atol=1e-6)


@pytest.mark.parametrize("method", ["generalized-alpha", "trapezoidal-index2"])
def test_turned_with_its_guide_it_moves_as_before(method):
    """From a start on the centre line: the first impacts, by angles of all sizes."""
    upright = run(slider_crank(clearance=True), method, energy=False)
    for turned in (1.0, -math.pi / 2, 2.5):
        other = run(slider_crank(turned, clearance=True), method, energy=False)
        both = [one.columns(("slider_x", "slider_y")) for one in (upright, other)]
        place = [columns["slider_x"] + 1j * columns["slider_y"] for columns in both]
        events = upright.event_table(), other.event_table()
        assert len(events[0]["start"]) >= 2
        assert list(events[1]["corner"]) == list(events[0]["corner"])
        # Newton's tolerance, which impacts magnify
        np.testing.assert_allclose(events[1]["start"], events[0]["start"], atol=1e-6)
        np.testing.assert_allclose(place[1] * cmath.exp(-1j * turned), place[0], atol=1e-8)


def test_what_does_not_fit_its_joints_is_refused():
    system = slider_crank()
    system.bodies[1] = system.bodies[1]._replace(position=(0.3, 0.0, 0.0))
    with pytest.raises(AssertionError, match="do not fit the joints"):
        run(system)
