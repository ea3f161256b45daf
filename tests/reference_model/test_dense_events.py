"""Ends of modes on any dense output: their rule, and that it is the compiled integrator's."""

import numpy as np
import pytest

from reference_model import dense_events, integrate
from reference_model.constants import Formulation
from reference_model.dense_events import end_of_mode, zero
from reference_model.dop853 import dense
from reference_model.forces import GAP, SLIP
from reference_model.formulations import free
from reference_model.isolation import RESOLUTION
from reference_model.progress import begin
from reference_model.reading import read_parameters
from reference_model.recording import samples_of
from reference_model.start import start
from reference_model.switching import margin_of


def test_a_zero_is_met_from_behind() -> None:
    """Just behind it, so that what has ended does not end once more."""
    for root in np.random.default_rng(0).uniform(1.0, 2.0, 100):
        found = zero(lambda t, root=root: root - t, 0.5, 2.5)
        assert 0.0 <= found - root < 5e-15  # 8 epsilon of 2.5 s, and less than that on Brent's side


@pytest.mark.parametrize(("value", "end"), [(lambda t: -1.0 - t, 3.0), (lambda t: 1.0 + t, 4.0)])
def test_a_zero_beyond_the_ends_is_the_nearer_end(value, end) -> None:
    assert zero(value, 3.0, 4.0) == end


@pytest.mark.parametrize("offset", [-1e-16, 0.0, 1e-16, -1e-9])
@pytest.mark.parametrize("flight", [0.9, 1e-3, 1e-5])
def test_what_starts_within_rounding_ends_where_it_comes_back(offset, flight) -> None:
    """A parabola that starts at `offset`, however wrong, and comes down again after a `flight`."""
    found = end_of_mode(lambda s: offset + s * (flight - s), 0.0, 1.0, RESOLUTION)
    # The slope there is -flight; a zero is met within 12 epsilon. From too deep an offset it never rises.
    rises = 4.0 * offset > -(flight**2)
    assert found == (pytest.approx(flight, abs=2.0 * abs(offset) / flight + 3e-15) if rises else 0.0)


def test_what_never_turns_right_ends_at_once() -> None:
    assert end_of_mode(lambda s: -s, 0.25, 1.0, RESOLUTION) == 0.25
    assert end_of_mode(lambda s: 0.9 * RESOLUTION - (s - 0.25), 0.25, 1.0, RESOLUTION) == pytest.approx(
        0.25, abs=1e-12
    )


def test_switches_are_those_of_the_compiled_integrator(scene, monkeypatch) -> None:
    """Every switch of 0.25 s, located once more on the compiled integrator's own dense output."""
    p = read_parameters(scene())
    c, y0 = start(p, Formulation.SLIDER)
    compiled, kinds, late = integrate.first_switch, set(), []

    def both(c, t, h, y, f, modes, before, stages, *scratch):
        share, contact, number = compiled(c, t, h, y, f, modes, before, stages, *scratch)

        def state_at(time):
            out = np.zeros(y.size)
            dense(y, f, (time - t) / h, free(c), out)
            return out

        def output(at):
            return np.transpose([state_at(time) for time in at]) if np.ndim(at) else state_at(at)

        found = dense_events.first_switch(c, modes, stages[-1], t, t + h, output, 0.0)
        assert (found is None) == (contact < 0)
        if found is not None:
            kind, _, _ = margin_of(c, modes, contact, number)
            assert found[1:] == (kind, contact)
            kinds.add(kind)
            late.append(found[0] - (t + share * h))
        return share, contact, number

    monkeypatch.setattr(integrate, "first_switch", both)
    nothing, largest = samples_of((), np.empty(0)), p.period / 50
    progress = begin(c, y0, 1e-6)
    assert integrate.advance.py_func(c, progress, 0.25, 0.25, 1e-9, largest, 10**6, nothing) == 0
    assert kinds == {GAP, SLIP}
    assert len(late) > 30
    # A gap rounds at 1e-16 m and closes at 1e-4 m/s or more: 1e-12 s.
    assert np.abs(late).max() < 1e-12
