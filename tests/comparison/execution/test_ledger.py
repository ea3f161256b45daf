"""Rows of finished work: no damaged one is used."""

from __future__ import annotations

import json
import logging
import random

from comparison.execution.ledger import append_row, read_rows

ROWS = {f"{number:064x}": {"status": "success", "x": 0.1 * number, "n": number} for number in range(20)}


def stored(path) -> bytes:
    path.unlink(missing_ok=True)
    for key, row in ROWS.items():
        append_row(path, key, row)
    return path.read_bytes()


def damaged(content: bytes, how: random.Random) -> bytes:
    at = how.randrange(len(content) - 1)
    kind = how.choice(["digit", "bit", "cut", "zeroed", "removed"])
    if kind == "digit":
        at = how.choice([place for place, byte in enumerate(content) if chr(byte).isdigit()])
        return content[:at] + bytes([48 + (content[at] - 47) % 10]) + content[at + 1 :]
    if kind == "bit":
        return content[:at] + bytes([content[at] ^ (1 << how.randrange(8))]) + content[at + 1 :]
    if kind == "cut":
        return content[:at]
    length = how.randrange(1, 300)
    middle = bytes(min(length, len(content) - at)) if kind == "zeroed" else b""
    return content[:at] + middle + content[at + length :]


def test_no_damaged_row_is_used_and_sound_ones_are(tmp_path):
    path = tmp_path / "rows.jsonl"
    content = stored(path)
    assert read_rows(path) == ROWS
    how = random.Random(22)
    for _ in range(300):
        path.write_bytes(damaged(content, how))
        found = read_rows(path)
        assert found.items() <= ROWS.items()
        if len(path.read_bytes()) == len(content):  # a digit, a bit, or zeros over at most three lines
            assert len(found) >= len(ROWS) - 4


def test_a_damaged_row_is_reported_once_and_one_cut_off_by_a_kill_is_not(tmp_path, caplog):
    path = tmp_path / "rows.jsonl"
    content = stored(path)
    path.write_bytes(content + b'{"key":"b","row":{"x"')
    assert read_rows(path) == ROWS
    assert caplog.records == []
    path.write_bytes(content.replace(b'"n":1}', b'"n":2}', 1).replace(b'"n":3}', b'"n":"a"}', 1))
    assert len(read_rows(path)) == len(ROWS) - 2
    (record,) = caplog.records
    assert record.levelno == logging.WARNING
    assert "2 lines are damaged" in record.getMessage()


def test_a_row_without_checksum_or_of_another_type_is_not_used(tmp_path):
    path = tmp_path / "rows.jsonl"
    lines = [{"key": "a", "row": {"x": 1}}, {"key": "a", "row": [1]}, {"key": ["a"], "row": {}}, [1], 1, None]
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    assert read_rows(path) == {}
