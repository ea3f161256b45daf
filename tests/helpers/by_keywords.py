"""The judge, with each criterion as a keyword; ``only`` names the channels."""

from comparison.verdict import compare as judge
from comparison.verdict import recorded
from comparison.verdict.channel import Criteria

_OTHERS = ("scene", "labels", "warnings", "tier", "ensembles")


def compare(a, b, **options):
    return judge.compare(a, b, **_split(**options))


def compare_recorded(a, b, **options):
    return recorded.compare_recorded(a, b, **_split(**options))


def _split(*, only=None, **options):
    others = {name: options.pop(name) for name in _OTHERS if name in options}
    return others | {"criteria": Criteria(channels=only, **options)}
