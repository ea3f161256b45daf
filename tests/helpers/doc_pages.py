"""Blocks of code of README.md and docs/*.md."""

import re
import shlex
from pathlib import Path

ROOT = Path(__file__).parents[2]


def blocks(page):
    text = (ROOT / page).read_text("utf-8")
    return re.findall(r"^```(\w+)\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def block(page, language, number=0):
    return [text for kind, text in blocks(page) if kind == language][number]


def commands(page, number=0):
    lines = [shlex.split(line) for line in block(page, "sh", number).splitlines()]
    assert {words[0] for words in lines} == {"sixbar"}
    return [words[1:] for words in lines]
