"""The regression gate on the command line, its baseline made, refused and renewed.

The models are fakes, controlled by the scene's gravity. What an unchanged scene, a new one and one that is
gone lead to is asked of the two models in tests/cli/test_gate.py.
"""

import json
import re
import shutil
import tomllib
from contextlib import suppress
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import pytest

from comparison.accuracy.levels import thresholds_record
from comparison.cli import main
from comparison.execution.run import VIOLATED
from comparison.regression import record
from comparison.regression.record import Baseline, checksum, read
from comparison.scene import shipped_scenes

BASELINE = Path("sixbar-baseline.toml")


@pytest.fixture
def scene_file(fake_models, tmp_path, monkeypatch):
    """Write a scene file beside the baseline; called again, it changes the scene."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setenv("COLUMNS", "2000")

    def make(name, gravity=9.81):
        assert fake_models.exists()
        Path(f"{name}.toml").write_text(
            f'[scene]\nextends = "paper"\n[environment]\ngravity = {gravity}\n'
            '[output]\nsamples_per_cycle = 100\ngroups = ["corners"]\n'
        )
        return f"{name}.toml"

    return make


@pytest.fixture(scope="session")
def kept(tmp_path_factory):
    """Where the first test leaves the baseline and its runs to the others."""
    return tmp_path_factory.mktemp("kept")


@pytest.fixture
def made(scene_file, kept, tmp_path, capsys):
    """A baseline of one scene, and its runs in the cache."""
    scene_file("own")
    if not (kept / "cache").exists():
        assert gate("own.toml", "--update") == 0
        out = capsys.readouterr().out.splitlines()
        assert re.fullmatch(r"own: 3 runs, \d+ checkpoints", out[0])
        assert out[1:] == [str(BASELINE)]
        shutil.copy(BASELINE, kept)
        shutil.copytree(tmp_path / "cache", kept / "cache")
    else:
        shutil.copy(kept / BASELINE, BASELINE)
        shutil.copytree(kept / "cache", tmp_path / "cache")
    return BASELINE


def gate(*arguments):
    """One worker: starting another costs more than the fakes' runs."""
    return main(["gate", *arguments, "--jobs", "1"])


def edit(pattern, by, *, seal=True):
    """Change the baseline; with the checksum of what it holds then, if that is a baseline at all."""
    text, count = re.subn(pattern, by, BASELINE.read_text(), count=1, flags=re.MULTILINE)
    assert count == 1
    BASELINE.write_text(text)
    with suppress(ValueError, KeyError):
        content = tomllib.loads(text if seal else "")
        content.pop("checksum")
        new = checksum(Baseline.model_validate(content))
        BASELINE.write_text(re.sub("^checksum = .*", f'checksum = "{new}"', text, flags=re.MULTILINE))


def checks():
    """The message of what did not pass, by run and item."""
    all_checks = json.loads(Path("reports/out/gate/gate.json").read_text())["checks"]
    return {(c["group"], c["name"]): c["message"] for c in all_checks if c["status"] in ("failed", "error")}


# ---- checks


@pytest.mark.usefixtures("made")
def test_a_change_of_one_model_names_it_with_channel_time_value_baseline_and_threshold(
    scene_file, gravity, capsys
):
    scene_file("own", gravity.differ)  # Exudyn's motion becomes larger by a thousandth
    assert gate() == 1
    out = capsys.readouterr().out
    assert "note: scene 'own': its numbers are not those that the baseline was made with" in out
    number = r"(-?[\d.e-]+)"
    said = (
        rf"exudyn tight, scene 'own': slider_x at t = {number} s is {number} m, in the baseline {number} m: "
        rf"off by {number} m, {number}% of its scale, the threshold is {number} m "
        r"\(\d of 5 checkpoints are off\)"
    )
    message = checks()["exudyn tight", "slider_x"]
    time, value, before, off, share, threshold = map(float, re.match(said, message).groups())
    assert share == pytest.approx(100 * off / 2e-4, rel=0.05)  # of the clearance
    assert 0 <= time <= 0.8
    assert abs(value - before) == pytest.approx(off, rel=0.02)
    assert threshold < off < 2e-4 * 1e-3 * 1.02
    assert {group for group, _ in checks()} == {"exudyn standard", "exudyn tight"}  # the reference passes


@pytest.mark.usefixtures("made")
def test_counters_are_exact_on_the_same_machine_and_within_5_percent_elsewhere(capsys):
    steps = [
        ("steps = 5", "steps = 100", 1, "reference tight, scene 'own': the counter steps is 5, in the base"),
        ("steps = 100", "steps = 6", 1, "steps is 5"),
        ('numpy = "[^"]*"', 'numpy = "0.1"', 0, "note: the baseline was made with numpy 0.1, here "),
        ("steps = 6", "steps = 8", 1, "note: counters are therefore compared within 5% and not exactly"),
        # One more or less is allowed, three of eight are not but for twice what neighbours differ by.
        ("^counters = .*", "\\g<0>\nspread = { steps = 1 }", 1, "steps is 5"),
        ("^spread = .*", "spread = { steps = 2 }", 0, ""),
        # The platform is a note, and a value that is moved by a metre is held to its threshold.
        ('^platform = "', 'platform = "Plan 9, ', 0, "note: the baseline was made on Plan 9, Linux"),
        (r"slider_x = \[\n  \[([\d.e-]+), -0", r"slider_x = [\n  [\1, -1", 1, "slider_x"),
    ]  # fmt: skip
    for pattern, by, code, said in steps:
        edit(pattern, by)
        assert gate() == code
        assert said in capsys.readouterr().out
    assert list(checks()) == [("reference tight", "slider_x")]


TIGHT, OTHER = '^\\[scenes."own".exudyn.tight', '[scenes."own".reference.standard'
ONE_SIDED = [
    ("^slider_vy = ", "slider_ax = ", "slider_ax", "slider_ax is in the baseline and not in the run"),
    ("^slider_vy = ", "slider_ax = ", "slider_vy", "the channel slider_vy has no baseline"),
    (TIGHT, OTHER, "run", "not any more"),
    (TIGHT, OTHER, "run", "no baseline of this run"),
    ("tolerance = 1e-12", "tolerance = 1e-11", "settings", "tolerance is 1e-12, in the baseline 1e-11"),
    (r"^slider_vy = \[\n  \[0", "slider_vy = [\n  [7", "slider_vy", "has no sample at t = 7"),
    # Nothing happened in it.
    (r"^(counters.*\n)((?:.*\n)*?)slider_x = \[\n(?:  .*\n)+\]\n", r'\1unexcited = ["slider_x"]\n\2',
     "slider_x",
     "in slider_x nothing happened in the baseline, its range was below 1e-12 m; now it is 0.0004 m"),
]  # fmt: skip


@pytest.mark.usefixtures("made")
@pytest.mark.parametrize(("pattern", "by", "item", "message"), ONE_SIDED)
def test_what_only_one_side_has_is_a_regression(pattern, by, item, message):
    for _ in range(1 + (by == OTHER)):  # the table of its channels too
        edit(pattern, by)
    assert gate() == 1
    assert any(message in said for (_, name), said in checks().items() if name == item), checks()


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


# ---- baselines


FIRST_POINT = r"slider_x = \[\n  \[[^]]*\]"
NONE = [
    ("^platform = .*", "", "platform is missing"),
    (r"^\[scenes(.|\n)*", "", "scenes is missing"),
    ("^platform = ", "platform ", "cannot be read as TOML: "),
    ("^platform", "colour = 1\nplatform", "colour is not"),
    ("contacts = 1", "contacts = -1", "scenes.own.reference.tight.counters.contacts = -1 must be "),
    (FIRST_POINT, "slider_x = [\n  [0.1, nan, 1.0]", "slider_x.0.1 = nan must be finite"),
    (FIRST_POINT, "slider_x = [\n  [0.1, 0.2, 0]", "slider_x.0.2 = 0 must be > 0"),
    (r"reference.tight\]", "reference.loose]", "= 'loose' must be 'standard' or 'tight'"),
    ("^checksum.*\n", "", "has no checksum"),
]


@pytest.mark.parametrize(("pattern", "by", "message"), NONE)
def test_a_baseline_that_is_none_is_one_line_and_exit_code_2(made, capsys, pattern, by, message):
    edit(pattern, by)
    text = made.read_text()
    for arguments in ([], ["--update"]):
        assert gate(*arguments) == 2
        out, err = capsys.readouterr()
        assert (out, err.count("\n")) == ("", 1)
        assert err.startswith("sixbar: sixbar-baseline.toml: ")
        assert message in err
    assert made.read_text() == text
    assert not Path("reports").exists()


def test_the_layout_of_a_baseline_does_not_count_nor_does_making_it_again_change_it(made, capsys):
    text = made.read_text()
    made.write_bytes(text.replace("\n", "\r\n").encode() + b"# checked\r\n")
    assert gate() == 0
    assert gate("--update") == 0
    assert made.read_text() == text
    edit("steps = 5", "steps = 6", seal=False)
    assert gate("--update") == 2
    assert "was changed since: its checksum does not match" in capsys.readouterr().err


def test_a_scene_is_found_from_the_folder_of_the_baseline_and_dropped_if_it_is_gone(scene_file, capsys):
    for name in ("own", "another"):
        assert gate(scene_file(name), "--baseline", "deep/base.toml", "--update") == 0
    assert tomllib.loads(Path("deep/base.toml").read_text())["scenes"]["own"]["source"] == "../own.toml"
    assert gate("--baseline", "deep/base.toml") == 0
    Path("own.toml").unlink()
    assert gate("--baseline", "deep/base.toml", "--update") == 0
    assert list(tomllib.loads(Path("deep/base.toml").read_text())["scenes"]) == ["another"]
    assert "scene 'own' of the old baseline no longer exists" in capsys.readouterr().err


def test_an_update_that_fails_leaves_the_baseline_alone(made, scene_file, gravity, capsys):
    before = made.read_text()
    scene_file("own", gravity.refuse)
    assert gate("--update") == 2
    assert "scene 'own': contact.law = 'foundation' is not simulated yet" in capsys.readouterr().err
    assert made.read_text() == before


def rates(**changes):
    record.RATES.parent.mkdir(parents=True, exist_ok=True)
    measured = {
        "false_alarms": {"count": 0, "runs": 300, "upper95": 0.00994},
        "detected": {"tight": {"faults": 25, "detected": 24, "interval_95": [0.8046, 0.9989]}},
        "thresholds": thresholds_record(),
    }
    record.RATES.write_text(json.dumps(measured | changes))


def test_thresholds_change_only_together_with_rates_measured_anew(made, monkeypatch, capsys):
    rates()
    assert gate("--update") == 0
    detection = tomllib.loads(made.read_text())["detection"]
    assert detection["false_alarms"] == {"count": 0, "runs": 300, "upper95": 0.00994}
    assert detection["detected"]["tight"]["interval_95"] == [0.8046, 0.9989]
    record.RATES.unlink()
    assert gate("--update") == 0  # the thresholds are the same: so are the rates
    assert tomllib.loads(made.read_text())["detection"] == detection
    changed = thresholds_record() | {"k": 3.0}
    for module in ("check", "record"):
        monkeypatch.setattr(f"comparison.regression.{module}.thresholds_record", lambda: changed)
    capsys.readouterr()
    assert gate() == 1
    assert "thresholds.toml is not what the baseline was made with" in capsys.readouterr().out
    assert gate("--update") == 2
    assert "is required, with newly measured rates" in capsys.readouterr().err
    rates()
    assert gate("--update") == 2
    assert "measured with other thresholds" in capsys.readouterr().err
    rates(thresholds=changed)
    assert gate("--update") == 0
    assert gate() == 0


@pytest.mark.usefixtures("made")
def test_rates_that_are_none_are_refused(capsys):
    rates(detected={"count": "many"})
    texts = {record.RATES.read_text(): "detected.count", "{": "cannot be read", "[" * 100_000: "is nested"}
    for text, said in texts.items():
        record.RATES.write_text(text)
        assert gate("--update") == 2
        assert f"trust.json: {said}" in capsys.readouterr().err


def test_a_coarser_run_may_violate_an_invariant_as_it_may_in_a_comparison(scene_file, monkeypatch, capsys):
    """What it gets wrong widens the thresholds; the gated run itself must hold its invariants."""
    scene_file("own")
    run_all = record.run_all

    def violating(kind):  # of the first family: base, finer, coarser
        def run(jobs, *more):
            outcomes = run_all(jobs, *more)
            bad = outcomes[kind]
            outcomes[kind] = replace(bad, status=VIOLATED, table=None, partial=bad.table)
            return outcomes

        monkeypatch.setattr(record, "run_all", run)

    violating(2)
    assert gate("own.toml", "--update") == 0
    violating(0)
    assert gate("own.toml", "--update") != 0
    assert VIOLATED in capsys.readouterr().err


def test_the_baseline_of_this_project_holds_every_shipped_scene_and_is_small():
    path = Path(str(files("comparison"))).parent / "sixbar-baseline.toml"
    baseline = read(path)
    assert list(baseline.scenes) == shipped_scenes()
    assert baseline.thresholds == thresholds_record()
    assert {len(scene.runs) for scene in baseline.scenes.values()} == {2, 3}
    # Five checkpoints of 33 characters of 21 channels in up to three runs, and 1.5 kB of their settings.
    assert path.stat().st_size < 12_000 * len(baseline.scenes)
