"""Pages, tables and printed figures that several studies use, and the switches of the literal law."""

import numpy as np
import pandas as pd
import pytest
from contact_tables import contacts_of

from comparison.execution.run import run_one
from comparison.scene import load_scene
from comparison.studies.contact_laws.study import created, depths, surplus, switches
from comparison.studies.shared.published import published
from comparison.studies.shared.study import (
    crossed,
    interval,
    quantities,
    rate,
    rows_table,
    share,
    single_page,
    upper_limit,
)
from comparison.tables.table import Table

SCENE = load_scene("150rpm-0.2mm").data


def test_rows_and_columns_stand_in_the_order_in_which_they_come_first_and_what_lacks_is_said():
    shown = crossed("modulus", ["10", "10", "2"], ["b", "a", "b"], ["p", "q", "r"])
    assert shown.splitlines() == ["| modulus | b | a |", "|---|---|---|", "| 10 | p | q |", "| 2 | r | n/a |"]
    frame = pd.DataFrame({"law": ["a", "b"], "depth_m": [5.2e-7, np.nan]})
    columns = {"law": "law", "deepest": ("depth_m", "m", 2), "force": ("force_N", "N")}
    lines = quantities(frame, columns).replace("\u00a0", " ").splitlines()[2:]
    assert lines == ["| a | 520 nm | n/a |", "| b | n/a | n/a |"]
    assert rows_table([]) == ""
    assert rows_table([{"a": "1|2", "b": "3"}]).splitlines() == ["| a | b |", "|---|---|", "| 1\\|2 | 3 |"]


def test_rates_and_their_limits():
    assert rate([1.0, 2.0, np.nan, 4.0, 8.0], [3.0, 12.0, 1.0, 48.0, -1.0]) == pytest.approx(2.0)
    assert np.isnan(rate([1.0, 2.0], [1.0, 0.0]))
    # Of 0 in n the limits solve (1 - p)^n = 0.025 and 0.05.
    assert interval(0, 10) == (0.0, pytest.approx(1 - 0.025**0.1))
    assert upper_limit(0, 10) == pytest.approx(1 - 0.05**0.1)
    assert (interval(0, 0), upper_limit(0, 0)) == ((0.0, 1.0), 1.0)
    assert [share(rate) for rate in (0.0123, 0.9951)] == ["1.2\u00a0%", "99.5\u00a0%"]


@pytest.mark.parametrize(
    ("row", "value", "rounding"),
    [("F7-R-a", -494.9, 0.05), ("F7-T-d", 0.4112e-5, 0.5e-9), ("F14a-x", -0.2497e-3, 5e-8)],
)
def test_figures_come_from_the_published_table_with_half_a_unit_of_their_last_digit(row, value, rounding):
    figure = published(row)
    assert figure.value == value
    assert figure.rounding == pytest.approx(rounding, rel=1e-12)


def test_the_page_holds_the_figures_and_shows_html_as_text(tmp_path):
    (tmp_path / "figure-1.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0"/></svg>')
    readme = tmp_path / "README.md"
    readme.write_text(
        "# Title & <b>\n\n[to](figure-1.svg) [it](#the-runs)\n\n## The runs\n\n"
        '| a |\n|---|\n| <script>x</script> |\n\n![Fig. 1: "x" < y](figure-1.svg)\n'
    )
    html = single_page(readme)
    assert "<script>" not in html
    assert "<img" not in html
    for part in (
        "<title>Title &amp; &lt;b&gt;</title>", "&lt;script&gt;",
        '<figure id="figure-1">', '<path d="M0 0"/>',
        "<td>", 'href="#figure-1"', 'href="#the-runs"', '<h2 id="the-runs">',
        "<figcaption>Fig. 1: &quot;x&quot; &lt; y</figcaption>",
    ):  # fmt: skip
        assert part in html


# ---- switches between corners and surface


@pytest.mark.parametrize(
    ("events", "expected"),
    [
        ([], []),
        ([("ll", 1, 3), ("ur", 2, 4)], []),  # of different sides
        ([("ll", 1, 3), ("ul", 2, 4)], [(2.0, True, "ll"), (3.0, False, "ul")]),
        ([("ul", 1, 5), ("ll", 2, 4)], [(2.0, True, "ul"), (4.0, False, "ul")]),
        (
            [("lr", 1, 9), ("ur", 2, 3), ("ur", 5, 6)],
            [(2.0, True, "lr"), (3.0, False, "lr"), (5.0, True, "lr"), (6.0, False, "lr")],
        ),
        ([("ll", 1, 3), ("ul", 3, 4)], []),  # they only meet
    ],
)
def test_switches_are_where_two_corners_of_a_side_begin_and_cease_to_touch(events, expected):
    assert list(switches(contacts_of(*events)).itertuples(index=False, name=None)) == expected


def test_the_energy_of_a_switch_is_the_jump_of_the_residual_and_two_between_samples_are_refused():
    time = np.arange(11) / 10
    residual = np.where(time > 0.25, -3.0, 0.0) + np.where(time > 0.52, 1.0, 0.0)
    table = Table(pd.DataFrame({"time": time, "energy_residual": residual}))
    apart = switches(contacts_of(("ll", 0.1, 0.9), ("ul", 0.25, 0.52)))
    assert created(apart, table).tolist() == [3.0, -1.0]
    near = switches(contacts_of(("ll", 0.1, 0.9), ("ul", 0.25, 0.29)))
    with pytest.raises(ValueError, match=r"samples 0\.1 s apart do not separate switches 0\.04 s apart"):
        created(near, table)
    assert created(switches(contacts_of()), table).size == 0


def test_every_switch_of_the_literal_law_creates_what_its_two_potentials_differ_by():
    # K = 4 / (3 * 2 sigma) sqrt(R), K_s = (T + L) / (0.475 * 2 sigma), sigma = (1 - 0.28^2) / 210 GPa:
    # 4.8038e9 N/m^1.5 and 2.8783e10 N/m (paper-model, Sec. 2), so at 1 um 4.7971e-3 - 1.9215e-6 J.
    assert surplus(np.array([1e-6, 0.0, -1e-9]), SCENE) == pytest.approx([4.795228e-3, 0, 0], rel=1e-4)
    values = {"contact.law": "paper-switching", "drive.cycles": 0.55, "output.groups": ["energy"]}
    # A sample every microsecond.
    literal = run_one(load_scene("150rpm-0.2mm", values | {"output.samples_per_cycle": 400_000}), "reference")
    switched = switches(literal.events)
    measured = created(switched, literal)
    theory = np.where(switched["to_surface"], 1, -1) * surplus(depths(switched, literal, SCENE), SCENE)
    assert len(switched) >= 4
    assert np.abs(measured).max() > 1e-4
    # Depths are read from samples 1 us beside the switch: 3e-4 of an energy; 1e-9 J is the integration's.
    assert measured == pytest.approx(theory, rel=1e-3, abs=1e-8)
    # Between switches nothing is created but the integration's error, 1e-9 J in a cycle.
    assert measured.sum() == pytest.approx(-literal.values("energy_residual")[-1], rel=1e-6, abs=1e-8)
