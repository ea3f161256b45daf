"""Whether a scene is chaotic: the one verdict that every report has, from the exponents of its runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum

from comparison.models import MODELS
from comparison.studies.nonlinear.methods.lyapunov import Exponent, closest_measured
from comparison.studies.nonlinear.scenes import DISTANCES, Key

NEAR = 0.01
"""Of the largest scatter over the angles: perturbed runs that start farther away are no neighbours."""


class Chaos(Enum):
    """What the exponents say of a scene."""

    CHAOTIC = "chaotic"
    REGULAR = "not chaotic"
    UNDECIDED = "undecided"


def believed(found: Mapping[Key, Sequence[Exponent]], scatter: Mapping[str, float]) -> dict[Key, Exponent]:
    """Return the exponent to believe of each orbit, of those whose perturbed runs are neighbours.

    Parameters
    ----------
    found
        Exponents, one a distance; none where the runs could not be followed.
    scatter
        Of each scene the largest scatter of its states over the angles, m.
    """
    best = {}
    for key, of in found.items():
        if of:
            name, model, _ = key
            near = [e for e, d in zip(of, DISTANCES[model], strict=True) if d <= NEAR * scatter[name]]
            best[key] = near[closest_measured(near)] if near else of[0]
    return best


def verdict(best: Mapping[Key, Exponent], name: str) -> Chaos:
    """Return whether a scene is chaotic, by the exponents to believe of its runs.

    Chaotic: positive in every run that measures it, in both models. Not chaotic: it, or its upper bound,
    negative in every run.
    """
    runs = {key: e for key, e in best.items() if key[0] == name}
    measured = {key: e for key, e in runs.items() if e.measured}
    if {e.sign for e in measured.values()} == {1} and {model for _, model, _ in measured} == set(MODELS):
        return Chaos.CHAOTIC
    return Chaos.REGULAR if runs and {e.sign for e in runs.values()} == {-1} else Chaos.UNDECIDED
