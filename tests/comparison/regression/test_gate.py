"""The regression gate on the command line. The models are fakes, controlled by the scene's gravity."""

from __future__ import annotations

import re

import pytest
from gate_command import BASELINE, checks, edit, gate, seal

pytestmark = pytest.mark.usefixtures("elsewhere", "wide")


@pytest.mark.usefixtures("made")
def test_a_change_of_one_model_names_it_with_channel_time_value_baseline_and_threshold(
    scene_file, gravity, capsys
):
    scene_file("own", gravity.differ)  # Exudyn's motion becomes larger by a thousandth
    assert gate() == 1
    out = capsys.readouterr().out
    assert "note: scene 'own': its numbers are not those that the baseline was made with" in out
    number = r"(-?[\d.e-]+)"
    time, value, before, off, threshold = map(
        float,
        re.search(
            rf"exudyn tight, scene 'own': slider_x at t = {number} s is {number} m, in the baseline "
            rf"{number} m: off by {number} m, the threshold is {number} m \(\d of 5 checkpoints are off\)",
            out,
        ).groups(),
    )
    assert 0 <= time <= 0.8
    assert abs(value - before) == pytest.approx(off, rel=0.02)
    assert threshold < off < 2e-4 * 1e-3 * 1.02
    assert {group for group, _ in checks()} == {"exudyn standard", "exudyn tight"}  # the reference passes


@pytest.mark.usefixtures("made")
def test_counters_are_exact_on_the_same_machine_and_within_5_percent_elsewhere(capsys):
    edit("steps = 5", "steps = 100")
    assert gate() == 1
    message = "reference tight, scene 'own': the counter steps is 5, in the baseline 100"
    assert message in capsys.readouterr().out
    edit("steps = 100", "steps = 6")
    assert gate() == 1
    edit('numpy = "[^"]*"', 'numpy = "0.1"')
    assert gate() == 0
    out = capsys.readouterr().out
    assert "note: the baseline was made with numpy 0.1, here " in out
    assert "note: counters are therefore compared within 5% and not exactly" in out
    edit("steps = 6", "steps = 8")  # one more or less is allowed, three of eight are not
    assert gate() == 1
    edit("^counters = .*", "\\g<0>\nspread = { steps = 1 }")  # twice what neighbours differ by is
    assert gate() == 1
    edit("^spread = .*", "spread = { steps = 2 }")
    assert gate() == 0


@pytest.mark.usefixtures("made")
def test_another_platform_is_a_note_and_values_are_held_to_their_thresholds_all_the_same(capsys):
    edit('^platform = "', 'platform = "Plan 9, ')
    assert gate() == 0
    assert "note: the baseline was made on Plan 9, Linux" in capsys.readouterr().out
    # The first value of the file, moved by a metre.
    edit(r"slider_x = \[\n  \[([\d.e-]+), -0", r"slider_x = [\n  [\1, -1")
    assert gate() == 1
    assert list(checks()) == [("reference tight", "slider_x")]


TIGHT = '^\\[scenes."own".exudyn.tight'
OTHER = '[scenes."own".reference.standard'
ONE_SIDED = [
    ("^slider_vy = ", "slider_ax = ", "slider_ax", "slider_ax is in the baseline and not in the run"),
    ("^slider_vy = ", "slider_ax = ", "slider_vy", "the channel slider_vy has no baseline"),
    (TIGHT, OTHER, "run", "not any more"),
    (TIGHT, OTHER, "run", "no baseline of this run"),
    ("tolerance = 1e-12", "tolerance = 1e-11", "settings", "tolerance is 1e-12, in the baseline 1e-11"),
    (r"^slider_vy = \[\n  \[0", "slider_vy = [\n  [7", "slider_vy", "has no sample at t = 7"),
]


@pytest.mark.usefixtures("made")
@pytest.mark.parametrize(("pattern", "by", "item", "message"), ONE_SIDED)
def test_what_only_one_side_has_is_a_regression(pattern, by, item, message):
    edit(pattern, by)
    if by == OTHER:
        edit(pattern, by)  # the table of its channels too
    assert gate() == 1
    assert any(message in case["message"] for (_, name), case in checks().items() if name == item)


@pytest.mark.usefixtures("made")
def test_a_channel_in_which_nothing_happened_must_stay_so():
    text = BASELINE.read_text()
    block = re.search(r"^slider_x = \[\n(?:  .*\n)+\]\n", text, re.MULTILINE).group()
    text = text.replace(block, "", 1)
    seal(re.sub("^counters.*\n", '\\g<0>unexcited = ["slider_x"]\n', text, count=1, flags=re.MULTILINE))
    assert gate() == 1
    (case,) = checks().values()
    assert "in slider_x nothing happened in the baseline" in case["message"]
    assert "now it is 0.0004 m" in case["message"]


@pytest.mark.usefixtures("made")
@pytest.mark.parametrize(("what", "code"), [("fail", 1), ("refuse", 1), ("crash", 70)])
def test_a_model_that_does_not_run_any_more_is_a_regression(scene_file, gravity, capsys, what, code):
    scene_file("own", getattr(gravity, what))
    assert gate() == code
    assert "REGRESSION exudyn standard, scene 'own': scene 'own': " in capsys.readouterr().out
    assert set(checks()) == {("exudyn standard", "run"), ("exudyn tight", "run")}


@pytest.mark.usefixtures("made")
def test_a_value_that_starts_nearby_reach_as_well_is_a_note_and_no_regression(scene_file, gravity, capsys):
    """Perturbed runs agree by chance, and the run has moved; the other neighbours part by more than that."""
    scene_file("own", gravity.lucky)
    assert gate() == 1
    assert {group for group, _ in checks()} == {"exudyn standard"}  # which has none
    said = r"note: exudyn tight, scene 'own': (\d+) channels deviate no more than 20 runs from neighbouring "
    assert int(re.search(said, capsys.readouterr().out)[1]) >= 10
