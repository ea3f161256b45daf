"""`sixbar gate`: a baseline is made, held, and a change of a model, a scene or the file is seen."""

import re

SCENE = '[scene]\nextends = "ideal"\n[drive]\ncycles = 0.02\n[output]\ngroups = []\n'
GATE = ["gate", "--baseline", "b.toml", "--out", "g", "--jobs", "1"]


def test_what_is_unchanged_passes_and_a_scene_that_changed_or_is_gone_is_a_regression(sixbar):
    sixbar.write("tiny.toml", SCENE)
    process = sixbar("gate", "tiny.toml", "--update", "--baseline", "b.toml", "--jobs", "1", "-q")
    assert process.lines[-1] == "b.toml"
    assert process.lines[0].startswith("tiny: 2 runs, ")
    assert sixbar(*GATE).lines[-1] == "g/report.html"
    assert "<svg" not in sixbar.text("g/report.html")
    result = sixbar.json("g/gate.json")
    assert (result["exit_code"], {check["status"] for check in result["checks"]}) == (0, {"passed"})
    assert result["command"] == "sixbar gate --baseline b.toml"
    suites = {(check["suite"], check["group"]) for check in result["checks"]}
    runs = {("tiny", "reference tight"), ("tiny", "exudyn standard")}
    assert suites == {("thresholds", "comparison"), *runs}
    assert sixbar.text("g/report.html").count('<tr><th scope="row">') == len(suites)  # a row a run
    assert [tag for tag, _ in sixbar.junit("g/junit.xml").values()] == [""] * len(result["checks"])
    assert str(len(result["checks"])) in sixbar.text("g/summary.md")
    sixbar.write("tiny.toml", SCENE + "[mechanism.rod4]\nlength = 0.2400001\n")
    process = sixbar(*GATE, code=1, COLUMNS="500")
    # When, which run, where, how large; a note on the scene; the runs, and counters last.
    first = (
        "REGRESSION from t = 0.0008 s on: .* scene 'tiny': slider_y at t = 0.0008 s is .*: off by 1e-07 m, 0"
    )
    assert re.match(first, process.lines[0]), process.lines[0]
    assert "scene 'tiny': its numbers are not those" in process.lines[1]
    assert re.match("REGRESSION .* scene 'tiny': . channels deviate, most of all slider_", process.lines[2])
    assert "counter" not in "".join(process.lines[:4])
    page = sixbar.text("g/report.html")
    assert page.index("from t = 0.0008 s on: ") < page.index("checks failed") < page.index("<svg")
    assert page.count("<figure") == page.count('role="img"') > 1
    assert "failure" in {tag for tag, _ in sixbar.junit("g/junit.xml").values()}
    assert "failed" in sixbar.text("g/summary.md")
    sixbar.write("other.toml", SCENE)
    assert "other" in sixbar("gate", "other.toml", *GATE[1:], code=1).out  # the baseline lacks it
    process = sixbar("gate", "other.toml", "--update", *GATE[1:3], "--jobs", "1", "-q")
    assert process.lines[0].startswith("other: 2 runs, ")
    assert process.lines[1:] == ["1 other scene is kept", "b.toml"]
    assert "its numbers are not those" in sixbar(*GATE, code=1).out  # still of the old tiny.toml
    (sixbar.folder / "tiny.toml").unlink()
    assert "tiny" in sixbar(*GATE, code=1).out
