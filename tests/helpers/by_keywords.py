"""The judge with criteria as keywords of its own, ``only`` the channels."""

from comparison.verdict import compare as judge
from comparison.verdict.channel import Criteria

_OTHERS = ("scene", "labels", "warnings", "tier", "ensembles")


def compare(a, b, *, only=None, **options):
    others = {name: options.pop(name) for name in _OTHERS if name in options}
    return judge.compare(a, b, criteria=Criteria(channels=only, **options), **others)
