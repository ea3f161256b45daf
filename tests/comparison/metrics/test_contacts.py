"""Situations, drawn forces and the parting contact, on tables of which these are known.

Random tables are compared a second way in tests/judge/test_second_opinion.py.
"""

import numpy as np
import pandas as pd
import pytest
from contact_tables import contacts_of

from comparison.metrics import PULSE_POINTS, WINDOW, parting_contact, pulses_of, time_shares
from comparison.tables.table import Table


@pytest.mark.parametrize(
    ("rows", "eighths"),
    [
        ([("ll", 1, 5), ("ul", 3, 6)], [3, 3, 2, 0]),
        ([("lr", 1, 5), ("ur", 5, 6)], [3, 5, 0, 0]),  # touching ends: never both
        ([("ll", 1, 5), ("ur", 3, 6)], [3, 3, 0, 2]),  # a diagonal
        ([("ll", 1, 6), ("ul", 2, 5), ("ur", 4, 7)], [2, 2, 2, 2]),  # three corners touch both walls
        ([("ll", -1, 1), ("ur", 7, 9)], [6, 2, 0, 0]),  # what is outside the run does not count
        ([("pin", -1, 1), ("pin", 1, 4)], [8, 0, 0, 0]),  # no corner
    ],
)
def test_the_shares_of_time_in_each_situation(rows, eighths):
    shares = [*time_shares(contacts_of(*rows), (0.0, 8.0)).values()]
    # Sums of at most some ten quotients of binary fractions: a few units of the last place.
    assert shares == pytest.approx([n / 8 for n in eighths], rel=0, abs=1e-15)


@pytest.mark.parametrize(
    ("count", "peak", "drawn"), [(20, 40.3, 1), (5, 40.0, 1), (4, 40.0, 0), (30, 40.5, 0), (30, 0.0, 0)]
)
def test_a_contact_is_drawn_if_it_has_enough_points_and_the_peak_of_its_event(count, peak, drawn):
    start = np.array([0.01, 0.02])
    events = pd.DataFrame({"corner": ["ll", "ur"], "start": start, "end": start + 2e-4, "peak_force": 40.0})
    phase = np.linspace(0.0, 1.0, count)
    time, force = 1e-6 + 2e-4 * phase, peak * np.sin(np.pi * phase)  # the touch is inside a step
    force[count // 2] = peak
    columns = {"row": np.full(count, 1), "time": 0.02 + time, "force": force}
    pulses = pulses_of(Table(pd.DataFrame({"time": [0.0, 1.0]}), events, pulses=columns))
    assert [pulse.row for pulse in pulses] == [1] * drawn
    for pulse in pulses:
        every = (pulse.time.size - 1) // (count - 1)
        # Differences of times of 0.02 s, rounded at 3.5e-18 s each
        np.testing.assert_allclose(pulse.time[::every], time, rtol=0, atol=1e-17)
        # A spline's nodes round at 1e-16 of the largest
        np.testing.assert_allclose(pulse.force[::every], force, rtol=0, atol=1e-15 * peak)
        assert pulse.time.size >= PULSE_POINTS
        assert pulse.force.max() == force.max()  # the spline is monotone between points


def test_the_first_contact_that_parts_two_groups_is_named():
    rng, window = np.random.default_rng(3), WINDOW * 0.4

    def run(*extra):
        common = ("ll", 0.01), ("ul", 0.01), ("ll", 0.1)
        rows = [(corner, start + 0.2 * window * rng.uniform(-1.0, 1.0)) for corner, start in common]
        return pd.DataFrame([*rows, *extra], columns=["corner", "start"])

    def parted(one, other, until=0.3):
        return parting_contact((one, other), period=0.4, until=until)

    with_contact = [run(("ul", 0.05), ("lr", 0.2)) for _ in range(5)]
    without = [run() for _ in range(20)]
    parting = parted(without, with_contact)
    assert (parting.corner, parting.having, parting.sizes) == ("ul", (0, 5), (20, 5))
    assert parting.start == pytest.approx(0.05)
    # What comes later is a consequence; and a contact that half of both have parts nothing.
    assert parted(without, with_contact, 0.04) is None
    mixed = [run(("ul", 0.05)) if n % 2 else run() for n in range(10)]
    assert parted(mixed, mixed[::-1]) is None
