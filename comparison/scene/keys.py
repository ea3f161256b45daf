"""All keys of a scene as the schema has them, and those that an unknown one may mean."""

import re
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from difflib import SequenceMatcher, get_close_matches
from functools import cache
from importlib.resources import files
from itertools import pairwise
from typing import Any, Literal, NamedTuple, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from comparison.scene.schema import SceneKeys, Source, Unit

_IN_SECTION, _IN_DESCRIPTION = 0.8, 0.6
"""How much a word counts that is not of a key's own name."""
_ABOVE = 0.4
"""How much a word counts of the section of a wrong name: which is often what is wrong."""
_ALIKE = 0.8
"""Share of letters that words have in common of which one is a typing error of the other."""
_CLOSE = 0.9
"""Score of keys that are named beside the best one."""
_FILLERS = ("a", "and", "at", "by", "for", "from", "in", "is", "its", "of", "or", "that", "the", "to")
_SIGNS = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}


class Key(NamedTuple):
    """Key of a scene."""

    name: str  # dotted
    unit: str  # empty without one
    bounds: str  # rule for the value: ">= 0", "ideal | clearance"
    default: object  # of a scene that extends "paper"; None without one
    source: str  # of the default: where the paper prints it, "identified" or "chosen"; empty without one
    description: str


@cache
def scene_keys() -> list[Key]:
    """Return all keys of a scene in the order of the schema; those of ``[[random]]`` as ``random[].key``."""
    text = files("comparison.scene.shipped").joinpath("paper.toml").read_text("utf-8")
    base = SceneKeys.model_validate(tomllib.loads(text)).model_dump(exclude={"scene", "random"})
    extends = "Scene whose values hold where this one has none: a shipped name or a path."
    return [Key("scene.extends", "", "text", None, "", extends), *_below(SceneKeys, base, "", "")]


def _below(section: type[BaseModel], defaults: Mapping[str, Any], above: str, unit: str) -> Iterator[Key]:
    for name, field in section.model_fields.items():
        notes = list(_notes(field))
        own_unit = next((note.symbol for note in notes if isinstance(note, Unit)), unit)
        default = defaults.get(name)
        item, mark = field.annotation, ""
        if get_origin(item) is list and isinstance(get_args(item)[0], type):  # of sections
            item, mark = get_args(item)[0], "[]"
        if isinstance(item, type) and issubclass(item, BaseModel):
            yield from _below(item, default or {}, f"{above}{name}{mark}.", own_unit)
            continue
        sources = [note.text for note in notes if isinstance(note, Source)] or ["chosen"]
        source = "" if default is None else sources[0]
        yield Key(f"{above}{name}", own_unit, _bounds(notes), default, source, field.description or "")


def _bounds(notes: list[Any]) -> str:
    """Return the rule for a value from what is noted of its type."""
    rules = [
        f"{sign} {getattr(note, limit):g}"
        for note in notes
        for limit, sign in _SIGNS.items()
        if hasattr(note, limit)
    ]
    choices = [" | ".join(map(str, get_args(note))) for note in notes if get_origin(note) is Literal]
    if list in notes:
        choices = [f"any of {choice.replace(' | ', ', ')}" for choice in choices]
        rows = "rows of " if notes.count(list) > 1 else ""
        choices += [f"{rows}{note.max_length} values" for note in notes if hasattr(note, "max_length")]
    words = {dict: "numbers by name", int: "integer", str: "text"}
    kinds = [word for kind, word in words.items() if kind in notes and not choices][:1]
    return ", ".join(dict.fromkeys(kinds + choices + rules))


def _notes(annotation: Any) -> Iterator[Any]:
    """Yield the types in an annotation, and what is noted of them."""
    if isinstance(annotation, FieldInfo):
        yield from annotation.metadata
        yield from _notes(annotation.annotation)
    elif get_origin(annotation) in (None, Literal):
        yield annotation
    else:
        yield get_origin(annotation)
        for part in get_args(annotation):
            yield from _notes(part)


def did_you_mean(wrong: str, known: Iterable[str] = ()) -> str:
    """Return the end of a message on an unknown key: one of its section misspelt, else what is `meant`."""
    section, _, last = wrong.rpartition(".")
    own = {name.rpartition(".")[2]: name for name in known if name.rpartition(".")[0] == section}
    names = [own[name] for name in get_close_matches(last, own, n=1, cutoff=_ALIKE)] or meant(wrong)
    listed = " or ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))
    return f"; did you mean {listed}?" if names else "; sixbar keys lists all"


def meant(wrong: str) -> list[str]:
    """Return up to three keys that an unknown dotted name may mean, best first; none where no word matches.

    Words of the name are held against those of names and descriptions; rare words count more.
    """
    vocabulary = _vocabulary()
    shared = Counter(word for weights in vocabulary.values() for word in weights)
    *above, last = ([_alike(word, shared) for word in _words(part)] for part in wrong.split("."))
    asked = [(alike, 1.0) for alike in last] + [(alike, _ABOVE) for part in above for alike in part]
    scores: dict[str, float] = {}
    for name, weights in vocabulary.items():
        matched: dict[str, float] = {}
        for alike, weight in asked:
            for word, likeness in alike.items():
                if word in weights:
                    matched[word] = weight * likeness * weights[word] / shared[word] ** 0.5
        if any(alike.keys() & matched for alike in last):
            *sections, own = map(set, map(_words, name.split(".")))
            parts = len(own & matched.keys()) + any(section & matched.keys() for section in sections)
            scores[name] = sum(matched.values()) * (1.0 + parts / (len(own) + 1))
    least = _CLOSE * max(scores.values(), default=0.0)
    ranked = sorted(scores, key=scores.__getitem__, reverse=True)
    return [name for name in ranked if scores[name] >= least and name != wrong][:3]


@cache
def _vocabulary() -> dict[str, dict[str, float]]:
    """Return the words known of each key that can be set, with their weights; also two in a row."""
    known = {}
    for key in scene_keys():
        if "[]" not in key.name:
            section, _, own = key.name.rpartition(".")
            weights: dict[str, float] = {}
            for text, weight in ((own, 1.0), (section, _IN_SECTION), (key.description, _IN_DESCRIPTION)):
                words = _words(text)
                for word in (*words, *map(" ".join, pairwise(words))):
                    weights.setdefault(word, weight)
            known[key.name] = weights
    return known


def _words(text: str) -> list[str]:
    """Return the words of a name or description; single letters are symbols: E is not e."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text.replace("'", ""))
    words = re.findall(r"(?<![A-Za-z0-9])[A-Za-z]+[0-9]*", apart.replace("_", " "))
    return [word if len(word) == 1 else word.lower() for word in words if word.lower() not in _FILLERS]


def _alike(word: str, known: Iterable[str]) -> dict[str, float]:
    """Return the known words that a word is, abbreviates or misspells, with their likeness up to 1."""
    if same := {each: 1.0 for each in known if each.replace(" ", "") == word}:
        return same
    alike = {
        each: 0.9 if each.startswith(word) else SequenceMatcher(None, word, each).ratio()
        for each in known
        if len(word) > 2 and " " not in each
    }
    return {each: likeness for each, likeness in alike.items() if likeness >= _ALIKE}
