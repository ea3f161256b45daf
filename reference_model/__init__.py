"""The hand-written solver of the paper's equations.

| equations | purpose | module |
|---|---|---|
| Fig. 4, Tables 1, 2 | numbers of the scene, refusal of bad input | `parameters` |
| rows 1-8 of Eq. 16 | driven four-bar, all bodies, ideal mechanism in closed form | `linkage`, `ideal` |
| - | refusal of a linkage that does not close | `simulation` |
| Eqs. 1-6 | corners, walls, gaps, forces of both sides and of a journal | `contact` |
| Eqs. 7-13 | contact laws, modified Coulomb friction | `laws` |
| Figs. 7, 8 | clearance at the crank pin A | `chain` |
| - | load of a workpiece, steps that end at its kinks | `workpiece`, `steps` |
| Eqs. 14-21 | coordinates and multipliers of any planar linkage, Baumgarte | `multiplier` |
| projections of these | the fewest coordinates | `minimal` (slider), `chain` (crank pin, both) |
| - | any other linkage: its scene and start; its run, singular positions | `planar`, `planar_run` |
| - | choice and start of a formulation, one interface to the three | `formulations` |
| - | data of a run | `state` |
| - | steps, and the instants in them at which a mode ends | `dop853`, `margins`, `events` |
| the paper's ode15s | scipy's BDF and others, same equations and margins | `scipy_solvers` |
| - | properties that every correct run has | `invariants` |

`simulation` calls `running`, which calls `integrate`. This takes steps that end at events, and records states
at the nodes of a step (`dop853`) as rows (`recording`). `observation` computes channels, extrema (`results`),
energies and reactions (`balance`) from many rows at a time. Python may call only those compiled functions
that are decorated as `kernel` (`compiled`).
"""

from reference_model.results import Result
from reference_model.simulation import simulate

__all__ = ["Result", "simulate"]
