"""The regression gate on the command line. The models are fakes, told by the scene's gravity what to do."""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from importlib.resources import files
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from comparison.accuracy.thresholds import thresholds_record
from comparison.cli import main
from comparison.regression import update
from comparison.regression.baseline import read
from comparison.scene import shipped_scenes

BASELINE = Path("sixbar-baseline.toml")


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")


@pytest.fixture
def scene_file(fake_models):
    """Write a scene file beside the baseline; called again, it changes the scene."""
    assert fake_models.exists()

    def make(name: str, gravity: float = 9.81) -> str:
        Path(f"{name}.toml").write_text(
            f'[scene]\nextends = "paper"\n[environment]\ngravity = {gravity}\n'
            '[output]\nsamples_per_cycle = 100\ngroups = ["corners"]\n'
        )
        return f"{name}.toml"

    return make


@pytest.fixture(scope="module")
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


def gate(*arguments: str) -> int:
    """One worker: starting another costs more than the fakes' runs."""
    return main(["gate", *arguments, "--jobs", "1"])


def edit(pattern: str, by: str) -> None:
    text, count = re.subn(pattern, by, BASELINE.read_text(), count=1, flags=re.MULTILINE)
    assert count == 1
    BASELINE.write_text(text)


def checks() -> dict[tuple[str, str], dict[str, str]]:
    """What did not pass, by run and item."""
    record = json.loads(Path("reports/out/gate/gate.json").read_text())
    return {(c["group"], c["name"]): c for c in record["checks"] if c["status"] in ("failed", "error")}


@pytest.mark.usefixtures("made")
def test_an_unchanged_tree_passes_with_one_worker_and_with_two(tmp_path, monkeypatch, capsys):
    records = []
    for jobs in ("1", "2"):
        monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path / f"cache{jobs}"))
        assert main(["gate", "--jobs", jobs]) == 0
        records.append(Path("reports/out/gate/gate.json").read_text())
    assert records[0] == records[1]
    out, err = capsys.readouterr()
    assert err == ""
    assert re.fullmatch(
        r"All \d+ checks passed: both models are what their baseline says", out.splitlines()[-2]
    )
    assert out.splitlines()[-1] == "reports/out/gate/summary.md"
    assert {path.name for path in Path("reports/out/gate").iterdir()} == {
        "gate.json",
        "junit.xml",
        "summary.md",
    }
    root = ET.parse("reports/out/gate/junit.xml").getroot()
    assert root.get("failures") == root.get("errors") == "0"
    assert int(root.get("tests")) == len(json.loads(records[0])["checks"]) > 50


@pytest.mark.usefixtures("made")
def test_a_change_of_one_model_names_it_with_channel_time_value_baseline_and_threshold(
    scene_file, gravity, capsys
):
    scene_file("own", gravity.differ)  # Exudyn's motion becomes larger by a thousandth
    assert gate() == 1
    out = capsys.readouterr().out
    assert "note: scene 'own': its numbers are not those that the baseline was made with" in out
    (line,) = [line for line in out.splitlines() if "exudyn tight, scene 'own': slider_x at" in line]
    number = r"(-?[\d.e-]+)"
    found = re.fullmatch(
        rf"REGRESSION exudyn tight, scene 'own': slider_x at t = {number} s is {number} m, in the baseline "
        rf"{number} m: off by {number} m, the threshold is {number} m \((\d) of 5 checkpoints are off\)",
        line,
    )
    time, value, before, off, threshold = map(float, found.groups()[:5])
    assert 0 <= time <= 0.8
    assert abs(value - before) == pytest.approx(off, rel=0.02)
    assert threshold < off < 2e-4 * 1e-3 * 1.02
    groups = {group for group, _ in checks()}
    assert groups == {"exudyn standard", "exudyn tight"}  # and the reference passes
    assert "exudyn tight" in Path("reports/out/gate/summary.md").read_text()


@pytest.mark.usefixtures("made")
def test_counters_are_exact_on_the_same_machine_and_within_5_percent_elsewhere(capsys):
    edit("steps = 5", "steps = 100")
    assert gate() == 1
    told = "reference tight, scene 'own': the counter steps is 5, in the baseline 100"
    assert told in capsys.readouterr().out
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


@pytest.mark.usefixtures("made")
@pytest.mark.parametrize(
    ("pattern", "by", "item", "told"),
    [
        ("^slider_vy = ", "slider_ax = ", "slider_ax", "slider_ax is in the baseline and not in the run"),
        ("^slider_vy = ", "slider_ax = ", "slider_vy", "the channel slider_vy has no baseline"),
        (r"^\[scenes.\"own\".exudyn.tight", '[scenes."own".reference.standard', "run", "not any more"),
        (
            r"^\[scenes.\"own\".exudyn.tight",
            '[scenes."own".reference.standard',
            "run",
            "no baseline of this run",
        ),
        ("tolerance = 1e-12", "tolerance = 1e-11", "settings", "tolerance is 1e-12, in the baseline 1e-11"),
        (r"^slider_vy = \[\n  \[0", "slider_vy = [\n  [7", "slider_vy", "has no sample at t = 7"),
        (
            r"^\[scenes.\"own\".reference.tight.channels\]",
            'unexcited = ["slider_ay"]\n\\g<0>',
            "slider_ay",
            "slider_ay is in the baseline and not in the run",
        ),
    ],
)
def test_what_only_one_side_has_is_a_regression(pattern, by, item, told):
    edit(pattern, by)
    if "reference.standard" in by:
        edit(pattern, by)  # the table of its channels too
    assert gate() == 1
    assert any(told in case["message"] for (_, name), case in checks().items() if name == item)


@pytest.mark.usefixtures("made")
def test_a_channel_in_which_nothing_happened_must_stay_so():
    text = BASELINE.read_text()
    block = re.search(r"^slider_x = \[\n(?:  .*\n)+\]\n", text, re.MULTILINE).group()
    text = text.replace(block, "", 1)
    BASELINE.write_text(
        re.sub("^counters.*\n", '\\g<0>unexcited = ["slider_x"]\n', text, count=1, flags=re.MULTILINE)
    )
    assert gate() == 1
    (case,) = checks().values()
    assert "in slider_x nothing happened in the baseline" in case["message"]
    assert "now it is 0.0004 m" in case["message"]


@pytest.mark.usefixtures("made")
def test_scenes_without_a_baseline_and_scenes_that_are_gone_are_regressions(scene_file, capsys):
    assert gate(scene_file("new")) == 1
    assert "scene 'new': there is no baseline of it" in capsys.readouterr().out
    Path("own.toml").unlink()
    assert gate() == 1
    assert "'own.toml' of the baseline is neither a shipped scene nor a file" in capsys.readouterr().out


@pytest.mark.usefixtures("made")
@pytest.mark.parametrize(("what", "code"), [("fail", 1), ("refuse", 1), ("crash", 70)])
def test_a_model_that_does_not_run_any_more_is_a_regression(scene_file, gravity, capsys, what, code):
    scene_file("own", getattr(gravity, what))
    assert gate() == code
    assert "REGRESSION exudyn standard, scene 'own': scene 'own': " in capsys.readouterr().out
    assert set(checks()) == {("exudyn standard", "run"), ("exudyn tight", "run")}


@pytest.mark.parametrize(
    ("pattern", "by", "told"),
    [
        (None, None, "sixbar-baseline.toml: there is no such baseline; sixbar gate --update makes one"),
        ("^platform = .*", "", "sixbar-baseline.toml: platform is missing"),
        (r"^\[scenes(.|\n)*", "", "sixbar-baseline.toml: scenes is missing"),
        ("^platform = ", "platform ", "sixbar-baseline.toml: is not TOML text: "),
        ("^platform", "colour = 1\nplatform", "sixbar-baseline.toml: colour = 1: "),
        ("contacts = 1", "contacts = -1", 'scenes.own.reference.tight.counters.contacts = -1: '),
        (r"slider_x = \[\n  \[", "slider_x = [\n  [nan, ", "slider_x.0"),
        (r"slider_x = \[\n  \[[^]]*\]", "slider_x = [\n  [0.1, nan, 1.0]", "slider_x.0.1 = nan: "),
        (r"slider_x = \[\n  \[[^]]*\]", "slider_x = [\n  [0.1, 0.2, 0]", "slider_x.0.2 = 0: "),
        (r"exudyn.tight\]", "adams.tight]", "scenes.own.exudyn.tight.settings is missing"),
        (r"reference.tight\]", "reference.loose]", "scenes.own.reference.loose.[key] = 'loose': "),
    ],
)  # fmt: skip
def test_a_baseline_that_is_none_is_one_line_and_exit_code_2(made, capsys, pattern, by, told):
    if pattern is None:
        made.unlink()
    else:
        edit(pattern, by)
    assert gate() == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("sixbar: ")
    assert told in err
    assert err.count("\n") == 1
    assert not Path("reports").exists()


def test_update_keeps_the_scenes_of_the_baseline_and_drops_those_that_are_gone(made, scene_file, capsys):
    before = made.read_text()
    assert gate("--update") == 0
    assert made.read_text() == before
    assert gate(scene_file("another"), "--update") == 0
    assert list(tomllib.loads(made.read_text())["scenes"]) == ["another", "own"]
    assert gate() == 0
    Path("own.toml").unlink()
    assert gate("--update") == 0
    assert list(tomllib.loads(made.read_text())["scenes"]) == ["another"]
    assert "scene 'own' of the old baseline is not found any more" in capsys.readouterr().err


def test_a_scene_is_found_from_the_folder_of_the_baseline(scene_file):
    assert gate(scene_file("own"), "--baseline", "deep/base.toml", "--update") == 0
    assert tomllib.loads(Path("deep/base.toml").read_text())["scenes"]["own"]["source"] == "../own.toml"
    assert gate("--baseline", "deep/base.toml") == 0


def test_an_update_that_fails_leaves_the_baseline_alone(made, scene_file, gravity, capsys):
    before = made.read_text()
    scene_file("own", gravity.refuse)
    assert gate("--update") == 2
    assert "scene 'own': contact.law = 'strip' is not simulated yet" in capsys.readouterr().err
    assert made.read_text() == before


def rates(changes: dict[str, object] | None = None) -> None:
    update.RATES.parent.mkdir(parents=True, exist_ok=True)
    measured = {
        "false_alarms": {"count": 0, "runs": 300, "upper95": 0.00994},
        "detected": {"tight": {"faults": 25, "detected": 24, "interval_95": [0.8046, 0.9989]}},
        "thresholds": thresholds_record(),
    }
    update.RATES.write_text(json.dumps(measured | (changes or {})))


def test_thresholds_change_only_together_with_rates_measured_anew(made, monkeypatch, capsys):
    rates()
    assert gate("--update") == 0
    detection = tomllib.loads(made.read_text())["detection"]
    assert detection["false_alarms"] == {"count": 0, "runs": 300, "upper95": 0.00994}
    assert detection["detected"]["tight"]["interval_95"] == [0.8046, 0.9989]
    update.RATES.unlink()
    assert gate("--update") == 0  # the thresholds are the same: so are the rates
    assert tomllib.loads(made.read_text())["detection"] == detection
    changed = thresholds_record() | {"k": 3.0}
    for module in ("check", "update"):
        monkeypatch.setattr(f"comparison.regression.{module}.thresholds_record", lambda: changed)
    capsys.readouterr()
    assert gate() == 1
    assert "thresholds.toml is not what the baseline was made with" in capsys.readouterr().out
    assert gate("--update") == 2
    assert "is needed, with rates measured anew" in capsys.readouterr().err
    rates()
    assert gate("--update") == 2
    assert "measured with other thresholds" in capsys.readouterr().err
    rates({"thresholds": changed})
    assert gate("--update") == 0
    assert gate() == 0


@pytest.mark.usefixtures("made")
def test_rates_that_are_none_are_refused(capsys):
    rates({"detected": {"count": "many"}})
    assert gate("--update") == 2
    assert "detection.json: detected.count" in capsys.readouterr().err


def test_the_baseline_of_this_project_holds_every_shipped_scene_and_is_small():
    path = Path(str(files("comparison"))).parent / "sixbar-baseline.toml"
    record = read(path)
    assert list(record.scenes) == shipped_scenes()
    assert record.thresholds == thresholds_record()
    assert {len(scene.runs) for scene in record.scenes.values()} == {2, 3}
    assert path.stat().st_size < 150_000  # a reader's patience with a difference of two versions
