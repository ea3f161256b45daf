"""A model's result in a notebook."""

from __future__ import annotations

from comparison.report.pictures.notebook import tabulated


def test_one_call_makes_a_table_that_shows_and_draws_itself(fake_model, central_case):
    table = tabulated(fake_model.simulate(central_case.data))
    assert list(table.frame)[:2] == ["time", "slider_x"]
    assert len(table.events) == 1
    shown = table._repr_html_()
    assert shown.startswith("<table><caption>")
    assert "success; 401 samples to 0.800 s, 1 contacts" in shown
    assert shown.count("<tr>") == 1 + len(table.channels)
    (axes,) = table.plot().axes
    assert axes.get_ylabel().startswith("slider x")
    upper, lower = table.plot("slider_vx", "slider_vy", other=table).axes
    assert len(upper.get_lines()) == len(lower.get_lines()) == 2


def test_names_are_escaped(fake_model, central_case):
    result = fake_model.simulate(central_case.data)
    result.columns["<b>"] = result.columns["time"]
    assert "<b>" not in tabulated(result)._repr_html_()
