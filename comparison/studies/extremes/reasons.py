"""Why a run did not converge, as far as the runs themselves show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

from comparison.execution.quality import FEW_STEPS
from comparison.execution.store import Row
from comparison.studies.extremes.campaign import CellOutcome
from comparison.studies.extremes.causes import Cause, Reason
from comparison.studies.extremes.cells import BASE_LABEL, LAWS, LITERAL_LAW, NEWTON
from comparison.studies.extremes.formulations import STRICT
from comparison.studies.extremes.refinement import HAIR
from comparison.studies.extremes.runs import BASE, out_of_time
from comparison.studies.extremes.verdicts import LARGER, Class, Refined, Verdict, apart

SCATTER = 10.0
"""Errors of single runs scatter by so much about their bound (`benchmarks/error_bounds.py`)."""
GAIN = 2.0
"""By which a finer setting, of a tenth of the tolerance or half the step, must err less at least."""
SLIGHTLY = 1.25
"""A smaller ratio explains nothing and is not reported."""
TOGETHER = 0.02
"""Cycles within which formulations leave the exact motion at one instant."""
USUAL_NEWTON = 1e-7
"""Newton's tolerance of the five bodies where a scene says nothing."""


@dataclass(frozen=True)
class Base:
    """What a cell's numbers are compared with."""

    bounded: CellOutcome
    """The cell that changes nothing under hertz-corners: the scene that error bounds are measured on."""
    law: CellOutcome
    """The same under the cell's own law."""


def bases(outcomes: Sequence[CellOutcome]) -> dict[str, Base]:
    """Return what the cells of each law are compared with."""
    unchanged = {of.cell.law: of for of in outcomes if of.cell.label == BASE_LABEL}
    bounded = unchanged[LAWS[0]]
    return {law: Base(bounded, unchanged.get(law, bounded)) for law in LAWS}


def unexplained(outcomes: Sequence[CellOutcome]) -> list[tuple[int, str]]:
    """Return the number of the cell and the formulation of each run whose class nothing explains."""
    by_law = bases(outcomes)
    return [
        (position, name)
        for position, of in enumerate(outcomes)
        for name in of.verdicts
        if any(why.cause is Cause.UNEXPLAINED for why in reasons(of, name, by_law[of.cell.law]))
    ]


def reasons(of: CellOutcome, name: str, base: Base) -> list[Reason]:
    """Return the reasons of a run's class; none for one that converged."""
    verdict, row = of.verdicts[name], of.rows[name]
    match verdict.kind:
        case Class.CONVERGED:
            return []
        case Class.REFUSED:
            # Where the same mechanism runs with a finer tolerance, only that was wrong.
            coarse = of.exact.get(STRICT.name, row)["status"] != "bad input"
            cause = Cause.COARSE_TOLERANCE if coarse else Cause.NO_MECHANISM
            return [Reason(cause, {"message": row["message"].removeprefix(f"scene {BASE!r}: ")})]
        case Class.UNCONFIRMED:
            return [
                Reason(Cause.UNCONFIRMED, {"method": exact, "ending": str(_ending(end))})
                for exact, end in of.exact.items()
            ]
        case Class.ANNOUNCED | Class.DEGRADED:
            return _why_degraded(of, name, base)
        case _:
            return [_ending(row), *([Reason(Cause.JAMMED)] if may_jam(of) else [])]


def may_jam(of: CellOutcome) -> bool:
    """Return whether friction can rotate a corner into its wall more than the wall rotates it out.

    A force N on a corner at (r_x, r_y) from the centre, with friction c_f N along the wall, rotates the
    slider by N (r_y - c_f r_x) / J5: inwards where c_f > r_y / r_x, length over width. What rod 4 lets the
    centre yield counts little beside it. The drive goes on all the same (Painleve's paradox).
    """
    data = of.cell.scene.data
    slider = data["mechanism"]["slider"]
    return bool(data["friction"]["coefficient"] > slider["length"] / slider["width"])


def _ending(row: Row) -> Reason:
    """Return how a run ended that did not finish."""
    cause = Cause.OUT_OF_TIME if out_of_time(row) else Cause.ENDED
    return Reason(cause, {name: row[name] for name in ("status", "limit") if name in row})


def _why_degraded(of: CellOutcome, name: str, base: Base) -> list[Reason]:
    """Return what makes the error larger than its bound, factor by factor, as far as that accounts for it."""
    verdict, row = of.verdicts[name], of.rows[name]
    if of.cell.law == LITERAL_LAW:
        return [Reason(Cause.LITERAL)]
    if not isfinite(verdict.bound):
        return [Reason(Cause.NO_BOUND)]
    if of.cell.axis == NEWTON and float(of.cell.label) > USUAL_NEWTON:
        return [Reason(Cause.NEWTON_ERROR)]
    steps, usual = row.get("steps_per_contact"), base.law.rows.get(name, {}).get("steps_per_contact")
    if steps is not None and steps < FEW_STEPS:
        return [Reason(Cause.FEW_STEPS, {"steps": steps})]
    found, accounted = [], verdict.bound
    own = base.bounded.verdicts.get(name)
    if own is not None and own.error > own.bound:
        accounted *= own.error / own.bound
        found.append(Reason(Cause.AS_IN_BASE, {"ratio": own.error / own.bound}))
    magnified = of.magnification / base.bounded.magnification
    if magnified > SLIGHTLY:
        accounted *= magnified
        found.append(Reason(Cause.MAGNIFIED, {"ratio": magnified}))
    if steps is not None and usual is not None and steps * SLIGHTLY < usual:
        # Of second order in the step over the contact's duration.
        accounted *= (usual / steps) ** 2
        found.append(Reason(Cause.FEWER_STEPS, {"steps": steps, "usual": usual}))
    if verdict.error <= SCATTER * accounted:
        return found or [Reason(Cause.SCATTERED, {"scatter": SCATTER})]
    return [*found, _last_resort(of, name)]


def _last_resort(of: CellOutcome, name: str) -> Reason:
    """Return the reason of an error that no factor accounts for."""
    verdict, strict = of.verdicts[name], apart(*of.exact.values())
    if strict > verdict.bound:
        return Reason(Cause.STRICT_APART, {"apart": strict})
    together = [
        other
        for other, its in of.verdicts.items()
        if other != name and its.kind in LARGER and abs(its.lasted - verdict.lasted) <= TOGETHER
    ]
    if together:
        return Reason(Cause.TOGETHER, {"lasted": verdict.lasted, "others": " and ".join(together)})
    return _of_refined(of.refined.get(name), verdict) or Reason(Cause.UNEXPLAINED)


def _of_refined(refined: Refined | None, verdict: Verdict) -> Reason | None:
    """Return what refined reruns say of the error; nothing where they do not account for it either."""
    if refined is not None and refined.apart >= verdict.error / SCATTER:
        return Reason(Cause.UNRESOLVED, {"hair": HAIR, "apart": refined.apart})
    if refined is None or refined.finer is None:
        return None
    if refined.finer.kind is Class.STOPPED:
        return Reason(Cause.EDGE, {"status": refined.status})
    if refined.finer.error <= verdict.error / GAIN:
        return Reason(Cause.TOO_COARSE, {"error": refined.finer.error})
    return None
