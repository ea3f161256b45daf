"""Tables of cells that are named by row and column."""

from __future__ import annotations

from comparison.studies.shared.frames import crossed


def test_rows_and_columns_stand_in_the_order_in_which_they_come_first_and_what_lacks_is_said():
    shown = crossed("modulus", ["10", "10", "2"], ["b", "a", "b"], ["p", "q", "r"])
    assert shown.splitlines() == ["| modulus | b | a |", "|---|---|---|", "| 10 | p | q |", "| 2 | r | n/a |"]
