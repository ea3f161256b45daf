"""Progress in a log: few plain lines, and nothing where nothing is asked."""

import pytest
import typer

from comparison.cli.progress import BETWEEN_LINES, SILENCE, Lines, progress


class Clock:
    """A clock that is set by hand."""

    now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


def test_a_line_for_every_tenth_but_not_more_often_than_the_interval(clock, capsys):
    report = Lines("campaign", clock)
    for step in range(200):  # half a percent a second
        clock.now += 1.0
        report((step + 1) / 200)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "sixbar: campaign: 10%, about 3 min left"
    assert lines[-1] == "sixbar: campaign: 90%, less than a minute left"
    assert len(lines) == 9
    assert BETWEEN_LINES == 10.0


def test_slow_work_is_not_silent_and_not_loud(clock, capsys):
    report = Lines("campaign", clock)
    for step in range(600):  # ten minutes for 6 %
        clock.now += 1.0
        report(step / 10_000)
    assert len(capsys.readouterr().err.splitlines()) == 600 / SILENCE


def test_a_finished_scene_is_a_line_at_most_one_in_the_interval_and_none_at_the_end(clock, capsys):
    report = Lines("4 scenes", clock)
    for done, seconds in ((1, 11.0), (2, 1.0), (3, 11.0), (4, 11.0)):
        clock.now += seconds
        report.finished(done / 4, f"{done} of 4 scenes; s{done}: agree")
    lines = capsys.readouterr().err.splitlines()
    assert [line.partition("; ")[2] for line in lines] == [
        "1 of 4 scenes; s1: agree",
        "3 of 4 scenes; s3: agree",
    ]


def test_cached_runs_do_not_make_the_rest_look_quick(clock, capsys):
    report = Lines("gate", clock)
    report(0.5)  # at once
    clock.now += 60.0
    report(0.6)  # 0.1 a minute: four more
    assert "60%, about 4 min left" in capsys.readouterr().err


def test_quiet_is_quiet_and_a_terminal_gets_a_bar_on_stderr(capsys, monkeypatch):
    with progress("gate", quiet=True) as report:
        report(0.5)
        report.finished(0.5, "one")
    assert capsys.readouterr() == ("", "")
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    with progress("gate") as report:
        report(0.5)
        report.finished(0.5, "one of two")
        typer.echo("a result")
    out, err = capsys.readouterr()
    assert out == "a result\n"
    assert "gate, one of two" in err
