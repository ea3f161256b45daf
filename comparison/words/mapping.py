"""A suggested mapping as a file to edit, with what each guess rests on, and as lines for the console."""

import json
import textwrap
from collections.abc import Iterator, Sequence
from math import isnan
from pathlib import Path

from comparison.formatting import number
from comparison.scene import command_line
from comparison.tables.mapping import TIME
from comparison.tables.suggest import DOUBTFUL, Guess, Suggestion


def mapping_text(suggestion: Suggestion, path: Path) -> str:
    """Return the mapping that is written to a path; doubtful rules are comments."""
    names = [str(each) for each in suggestion.paths]
    options = ["--mapping", str(path), "--tolerance", "0.01"]
    lines = [
        "# A suggestion: check what it rests on, edit it, then",
        f"#   {command_line('compare', names, {}, options)}",
        f'# "a" is {names[0]}, "b" is {names[1]}. A channel is (sign * column + offset) * unit.',
        "# What is doubtful is commented out: uncomment what is right, in `compare` as well.",
        "",
    ]
    assigned, doubtful = (suggestion.channels(doubtful=doubt) for doubt in (False, True))
    if assigned:
        lines += ["compare = [", *(f"    {json.dumps(name)}," for name in assigned)]
        lines += [*(f"    # {json.dumps(name)}," for name in doubtful), "]"]
    elif doubtful:
        lines.append(f"# compare = {json.dumps(doubtful)}")
    for guess in suggestion.guesses:
        mark = "# " if guess.sureness == DOUBTFUL else ""
        lines += ["", f"# {guess.sureness}: {_grounds(guess)}", *(mark + line for line in _rule(guess))]
    for side in "ab":
        rest = {column: similar for letter, column, similar in suggestion.left if letter == side}
        if rest:
            lines += ["", f'# Not assigned of "{side}":']
        lines += textwrap.wrap(
            "; ".join(f"{column}{_similar(similar)}" for column, similar in rest.items()),
            100,
            initial_indent="#   ",
            subsequent_indent="#   ",
            break_long_words=False,
            break_on_hyphens=False,
        )
    # A name may hold what TOML does not allow in a comment.
    return "".join("".join(c if c.isprintable() else " " for c in line) + "\n" for line in lines)


def _similar(columns: Sequence[tuple[str, float]]) -> str:
    known = ", ".join(f"{name} ({share:.3f})" for name, share in columns)
    return f" (correlates with {known})" if columns else ""


def summary(suggestion: Suggestion) -> Iterator[str]:
    """Yield a line for each guess, and how many columns are left."""
    for guess in suggestion.guesses:
        yield f"{guess.sureness:<8}  {guess.side}: {guess.column} is {guess.channel} ({guess.unit})"
    for side in "ab":
        if count := sum(which == side for which, *_ in suggestion.left):
            yield f"{side}: {count} {'column is' if count == 1 else 'columns are'} not assigned"


def _grounds(guess: Guess) -> str:
    """Return what a guess rests on."""
    grounds = ["by its name" if guess.named else "not by its name"]
    if guess.channel != TIME and isnan(guess.distance):
        grounds.append("the data do not tell")
    elif guess.channel != TIME:
        grounds.append(f"{number(100 * guess.distance, 2)} % (RMS) away from {guess.partner}")
    if guess.stated is None:
        grounds.append("no unit is stated in either table")
    else:
        unit = "is stated" if guess.stated else f"by comparison with {guess.partner}"
        grounds.append(f"the unit {unit}")
    return "; ".join(grounds)


def _rule(guess: Guess) -> Iterator[str]:
    """Yield the lines of a rule."""
    yield f"[{guess.side}.{json.dumps(guess.column, ensure_ascii=False)}]"
    yield f'channel = "{guess.channel}"'
    yield f'unit = "{guess.unit}"'
    if guess.sign != 1:
        yield f"sign = {guess.sign}"
    if guess.offset:
        yield f"offset = {guess.offset!r}"
