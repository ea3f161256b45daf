"""The pieces of modified Coulomb friction: together Eqs. 12-13, each next to the one that follows it."""

import numpy as np
import pytest

from reference_model.constants import Formulation, as_record
from reference_model.events import next_regime
from reference_model.friction import friction_force, friction_regime
from reference_model.reading import read_parameters


@pytest.fixture(params=[1e-4, 0.0, 1e-14], ids=["static speed", "none", "narrower than located"])
def law(request, scene):
    p = read_parameters(scene({"friction.static_speed": request.param}))
    return p, as_record(p.constants, Formulation.SLIDER)


def test_pieces_make_up_the_law(law) -> None:
    p, c = law
    v0, v1 = p.static_speed, p.transition_speed
    for slip in (*np.linspace(-2.0 * v1, 2.0 * v1, 41), 0.0):
        correction = min(1.0, max(0.0, (abs(slip) - v0) / (v1 - v0)))
        expected = -p.friction_coefficient * 7.0 * correction * np.sign(slip)
        found = friction_force(c, 7.0, slip, friction_regime(c, slip))
        # Of a force of 1 N, where a range of 1e-14 m/s is left out of a ramp of 1e-3 m/s.
        assert found == pytest.approx(expected, abs=2e-11)


def test_a_piece_hands_over_to_the_one_on_the_other_side_of_its_bound(law) -> None:
    p, c = law
    kinks = (p.static_speed, p.transition_speed) if p.static_speed >= 1e-10 else (p.transition_speed,)
    for bound in (sign * kink for sign in (-1.0, 1.0) for kink in kinks):
        below, above = (friction_regime(c, bound + change) for change in (-1e-9, 1e-9))
        assert below != above
        # Located to within 1e-13 m/s, on either side.
        for slip in (bound - 1e-13, bound + 1e-13):
            assert next_regime(c, below, slip) == above
            assert next_regime(c, above, slip) == below


def test_nothing_ends_where_the_slip_turns_without_a_static_speed(law) -> None:
    p, c = law
    regimes = {friction_regime(c, slip) for slip in (-1e-6, 0.0, 1e-6)}
    forces = {tuple(friction_force(c, 7.0, slip, k) for slip in (-1e-5, 0.0, 1e-5)) for k in regimes}
    if p.static_speed < 1e-10:
        # Across 0 it is one piece, whichever of its names it has.
        assert len(forces) == 1
        assert {next_regime(c, k, p.transition_speed) for k in regimes} == {2}
        assert {next_regime(c, k, -p.transition_speed) for k in regimes} == {-2}
    else:
        assert regimes == {0}
