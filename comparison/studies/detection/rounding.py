"""Variants of rounding: what differs between machines, brought about on one.

A processor decides which code OpenBLAS and the C library's mathematical functions run, and these round
differently. Each library can be set otherwise by a variable of the environment, read while the process
starts. A compiler decides in which order a sum is added up; that is what copies of the two models with one
expression rearranged stand for. Whether a variant changes anything is measured on the machine at hand, as a
hash of a table of each model: a variant that changes no bit of either is not counted.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from comparison.accuracy.levels import TIERS
from comparison.execution.run import run_one
from comparison.models import MODELS
from comparison.studies.detection.copies import Change, load_copy
from comparison.studies.detection.faults import scenes
from comparison.studies.detection.tasks import Comparison, Found, Side, refusal

REARRANGED = (
    # The stages of a Runge-Kutta step from the last to the first.
    Change(
        engine="reference_rearranged",
        model="reference",
        file="dop853.py",
        old="                for j in range(i):\n                    total += A[i, j]",
        new="                for j in range(i - 1, -1, -1):\n                    total += A[i, j]",
    ),
    # The damped force as a sum of two forces: of every contact, in both formulations.
    Change(
        engine="exudyn_rearranged",
        model="exudyn",
        file="laws.py",
        old="elastic * (1.0 + law[DAMPING] * depth_rate / impact_speed)",
        new="elastic + elastic * law[DAMPING] * depth_rate / impact_speed",
    ),
)
"""Copies of the models with one expression added up in another order."""

# A kernel without AVX, that every x86-64 processor can run.
_BLAS = (("OPENBLAS_CORETYPE", "Prescott"),)
# glibc 2.33 and newer, and what the feature was called before; unknown names are passed over.
_LIBM = (("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-FMA,-FMA_Usable"),)


@dataclass(frozen=True)
class Rounding:
    """One variant."""

    name: str
    environment: tuple[tuple[str, str], ...] = ()
    """Variables, and their values, of the processes in which the models run."""
    engines: Mapping[str, str] = field(default_factory=dict, hash=False)
    """Model -> the copy that runs in its stead."""


_COPIES = {copy.model: copy.engine for copy in REARRANGED}
ROUNDINGS = (
    Rounding("as the machine has it"),
    Rounding("another BLAS kernel", _BLAS),
    Rounding("mathematical functions without FMA", _LIBM),
    Rounding("another BLAS kernel, functions without FMA", _BLAS + _LIBM),
    Rounding("sums in another order", (), _COPIES),
    Rounding("sums in another order, functions without FMA", _LIBM, _COPIES),
)
"""The first one is what the others are held against."""


@dataclass(frozen=True)
class Bits(Comparison):
    """The hash of one run under a variant."""

    side: Side
    environment: tuple[tuple[str, str], ...]

    @property
    def sides(self) -> tuple[Side, ...]:
        """The one that is run."""
        return (self.side,)

    @property
    def cost(self) -> float:
        """Expected time, s."""
        return self.side.cost

    def find(self) -> Found:
        """Return the hash of all numbers of the table; that of a run that fails is why it did."""
        if self.side.engine:
            load_copy(self.side.engine)
        frame = run_one(self.side.scene, self.side.runs_by).frame
        return refusal("") | {"bits": hashlib.sha256(frame.to_numpy().tobytes()).hexdigest()}


def measurements(roundings: Sequence[Rounding]) -> list[Bits]:
    """Return what is measured of the variants, one after the other: of each as many as there are `PLACES`."""
    return [
        Bits(Side(scenes(tier)["press"], model, rounding.engines.get(model, "")), rounding.environment)
        for rounding in roundings
        for model, tier in PLACES
    ]


PLACES = tuple((model, tier) for tier in TIERS for model in MODELS)
"""Model and tier of the tables that are hashed: both have settings or formulations of their own at each."""


def hashes(roundings: Sequence[Rounding], found: Sequence[Found]) -> dict[Rounding, tuple[str, ...]]:
    """Return the hashes of each variant, by `PLACES`, from what was found by `measurements`."""
    bits = [str(result.get("bits", result["reason"])) for result in found]
    width = len(PLACES)
    return {variant: tuple(bits[n * width : (n + 1) * width]) for n, variant in enumerate(roundings)}


def effective(measured: Mapping[Rounding, tuple[str, ...]], tier: str) -> list[Rounding]:
    """Return the variants that give runs of their own at a tier: the first, and each unlike all before it."""
    columns = [at for at, place in enumerate(PLACES) if place[1] == tier]
    known: dict[tuple[str, ...], Rounding] = {}
    for rounding, bits in measured.items():
        known.setdefault(tuple(bits[at] for at in columns), rounding)
    return list(known.values())
