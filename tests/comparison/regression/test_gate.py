"""The gate and its baseline made, refused and renewed, by fake models; see tests/cli/test_gate.py."""

import json
import re
import shutil
import tomllib
from contextlib import suppress
from importlib.resources import files
from pathlib import Path

import pytest
from fake_model import GRAVITY

from comparison.accuracy.levels import thresholds_record
from comparison.cli import main
from comparison.regression.record import RATES, Baseline, checksum, read
from comparison.scene import shipped_scenes

BASELINE = Path("sixbar-baseline.toml")


def write_scene(gravity=9.81):
    Path("own.toml").write_text(
        f'[scene]\nextends = "paper"\n[environment]\ngravity = {gravity}\n'
        '[output]\nsamples_per_cycle = 100\ngroups = ["corners"]\n'
    )


@pytest.fixture(scope="module")
def baseline_folder(fakes, tmp_path_factory):
    """A folder with a scene, its baseline and its runs in the cache."""
    folder = tmp_path_factory.mktemp("recorded")
    with pytest.MonkeyPatch.context() as monkeypatch, fakes(folder, monkeypatch):
        monkeypatch.chdir(folder)
        write_scene()
        assert gate("own.toml", "--update") == 0
    return folder


@pytest.fixture(autouse=True)
def _in_a_copy(baseline_folder, fakes, tmp_path, monkeypatch):
    folder = shutil.copytree(baseline_folder, tmp_path / "here")
    monkeypatch.setenv("COLUMNS", "2000")
    with fakes(folder, monkeypatch):
        monkeypatch.chdir(folder)
        yield


def gate(*arguments):
    """One worker: starting another costs more than the fakes' runs."""
    return main(["gate", *arguments, "--jobs", "1"])


def edit(pattern, replacement, *, seal=True):
    """Change the baseline, and its checksum if the result can have one."""
    text, count = re.subn(pattern, replacement, BASELINE.read_text(), count=1, flags=re.MULTILINE)
    assert count == 1
    BASELINE.write_text(text)
    with suppress(ValueError, KeyError):
        content = tomllib.loads(text if seal else "")
        content.pop("checksum")
        new = checksum(Baseline.model_validate(content))
        BASELINE.write_text(re.sub("^checksum = .*", f'checksum = "{new}"', text, flags=re.MULTILINE))


def checks():
    """Messages of the checks that did not pass, by run and item."""
    all_checks = json.loads(Path("reports/out/gate/gate.json").read_text())["checks"]
    return {(c["group"], c["name"]): c["message"] for c in all_checks if c["status"] in ("failed", "error")}


def test_counters_are_exact_on_the_same_machine_and_within_5_percent_elsewhere(capsys):
    steps = [
        ("steps = 5", "steps = 100", 1, "reference tight, scene 'own': the counter steps is 5, in the base"),
        ('numpy = "[^"]*"', 'numpy = "0.1"', 1, "note: counters are therefore compared within 5% and not ex"),
        ("steps = 100", "steps = 6", 0, "note: the baseline was made with numpy 0.1, here "),
        # One more or less is allowed, or twice the spread of neighbours: three only at a spread of two.
        ("^(counters = .*)steps = 6(.*)", "\\1steps = 8\\2\nspread = { steps = 1 }", 1, "steps is 5"),
        ("^spread = .*", "spread = { steps = 2 }", 0, ""),
        # The platform is a note, and a value that is moved by a metre is held to its threshold.
        ('^platform = "', 'platform = "Plan 9, ', 0, "note: the baseline was made on Plan 9, Linux"),
        (r"slider_x = \[\n  \[([\d.e-]+), -0", r"slider_x = [\n  [\1, -1", 1, "slider_x"),
    ]  # fmt: skip
    for pattern, replacement, code, line in steps:
        edit(pattern, replacement)
        assert gate() == code
        assert line in capsys.readouterr().out
    ((run, message),) = checks().items()
    assert run == ("reference tight", "slider_x")
    difference, share = map(float, re.search(r"off by (\S+) m, (\S+)% of its scale", message).groups())
    assert share == pytest.approx(100 * difference / 2e-4, rel=0.05)  # of the clearance


def test_what_only_one_side_has_is_a_regression(capsys):
    """A channel, a run, a setting, a sample; and a channel in which nothing happened."""
    run = "^(counters.*\\n)((?:.*\\n)*?)"
    for pattern, replacement in (
        (f"{run}slider_x = \\[\\n(?:  .*\\n)+\\]\\n", r'\1unexcited = ["slider_x"]\n\2'),
        ("^slider_vy = ", "slider_ax = "),
        (r"^slider_omega = \[\n  \[0", "slider_omega = [\n  [7"),
        ("tolerance = 1e-12", "tolerance = 1e-11"),
        *[('^\\[scenes."own".exudyn.tight', '[scenes."own".reference.standard')] * 2,
    ):
        edit(pattern, replacement)
    assert gate() == 1
    assert "values of constant channels that it lacks: 1; " in capsys.readouterr().out
    messages = checks()
    for (run, item), message in {
        ("reference tight", "slider_x"): "was constant in the baseline, within 1e-12 m; now its range",
        ("reference tight", "slider_ax"): "slider_ax is in the baseline and not in the run",
        ("reference tight", "slider_vy"): "the channel slider_vy has no baseline",
        ("reference tight", "slider_omega"): "has no sample at t = 7",
        ("reference tight", "settings"): "tolerance is 1e-12, in the baseline 1e-11",
        ("reference standard", "run"): "not any more",
        ("exudyn tight", "run"): "no baseline of this run",
    }.items():
        assert message in messages[run, item]


@pytest.mark.parametrize(("fault", "code"), [("fail", 1), ("crash", 70)])
def test_a_model_that_does_not_run_any_more_is_a_regression(capsys, fault, code):
    write_scene(getattr(GRAVITY, fault))
    assert gate() == code
    assert "REGRESSION exudyn standard, scene 'own': scene 'own': " in capsys.readouterr().out
    assert set(checks()) == {("exudyn standard", "run"), ("exudyn tight", "run")}


def test_a_value_that_starts_nearby_reach_as_well_is_a_note_and_no_regression(capsys):
    """Perturbed runs agree by chance, and the run has moved; the other neighbours part by more than that."""
    write_scene(GRAVITY.lucky)
    assert gate() == 1
    assert {group for group, _ in checks()} == {"exudyn standard"}  # which has none
    note = r"note: exudyn tight, scene 'own': (\d+) channels deviate no more than 20 runs from neighbouring "
    assert int(re.search(note, capsys.readouterr().out)[1]) >= 10


def test_the_layout_of_a_baseline_does_not_count_nor_does_making_it_again_change_it(capsys):
    text = BASELINE.read_text()
    BASELINE.write_bytes(text.replace("\n", "\r\n").encode() + b"# checked\r\n")
    assert gate() == 0
    assert gate("--update") == 0
    assert BASELINE.read_text() == text
    edit("steps = 5", "steps = 6", seal=False)
    assert gate("--update") == 2
    assert "does not match its checksum: it was edited" in capsys.readouterr().err


def test_a_baseline_of_other_versions_is_made_anew_as_a_whole(capsys):
    Path("second.toml").write_text(Path("own.toml").read_text())
    assert gate("second.toml", "--update") == 0
    assert "1 other scene is kept" in capsys.readouterr().out
    edit('numpy = "[^"]*"', 'numpy = "0.1"')
    assert gate("second.toml", "--update") == 0
    output = capsys.readouterr()
    assert "all scenes of the baseline are made anew" in output.err
    assert "kept" not in output.out
    assert [*read(BASELINE).scenes] == ["own", "second"]


def test_thresholds_change_only_together_with_rates_measured_anew(capsys):
    edit("^thresholds = { k = 2.0", "thresholds = { k = 3.0")
    assert gate() == 1
    assert "thresholds.toml is not what the baseline was made with" in capsys.readouterr().out
    RATES.parent.mkdir(parents=True)
    RATES.write_text(json.dumps({"false_alarms": {}, "detected": {}, "thresholds": {"k": 3.0}}))
    assert gate("--update") == 2
    assert "measured with other thresholds" in capsys.readouterr().err


def test_the_baseline_of_this_project_holds_every_shipped_scene():
    baseline = read(Path(str(files("comparison"))).parent / "sixbar-baseline.toml")
    assert list(baseline.scenes) == shipped_scenes()
    assert baseline.thresholds == thresholds_record()
    assert {len(scene.runs) for scene in baseline.scenes.values()} == {2, 3}
