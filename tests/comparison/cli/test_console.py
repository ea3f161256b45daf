"""Progress in a log."""

import re

from comparison.cli import console


def test_progress_in_a_log_is_a_line_now_and_then(monkeypatch, capsys):
    """Not on a terminal: the share, and what is left; nothing at the end, nor before the interval is over."""
    with console.progress("campaign") as report:
        report(0.1)
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(console, "BETWEEN_LINES", 0.0)
    with console.progress("campaign") as report:
        for share in (0.0, 0.25, 1.0):
            report(share)
    first, second = capsys.readouterr().err.splitlines()
    assert first == "sixbar: campaign: 0%"
    assert re.fullmatch(r"sixbar: campaign: 25%, about \d+ min left", second)
