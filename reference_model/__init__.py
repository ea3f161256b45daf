"""The hand-written solver of the paper's equations.

| equations | what | where |
|---|---|---|
| Fig. 4, Tables 1, 2 | the scene's numbers, bad input | `parameters` |
| rows 1-8 of Eq. 16 | driven four-bar, all bodies, ideal mechanism in closed form | `linkage`, `ideal` |
| t = 0 | what can be assembled | `simulation` |
| Eqs. 1-6 | corners, walls, gaps, both sides' forces | `contact` |
| Eqs. 7-13 | contact laws, modified Coulomb friction | `laws` |
| Figs. 7, 8 | clearance at the crank pin A | `chain` |
| - | load of a workpiece, steps that end at its kinks | `workpiece`, `steps` |
| Eqs. 14-21 | coordinates and multipliers of any planar linkage, Baumgarte | `multiplier` |
| their projections | the fewest coordinates | `minimal` (slider), `chain` (crank pin, both) |
| - | one interface to these three | `equations` |
| - | data of a run | `state` |
| - | steps, and where in them a mode ends | `dop853`, `margins`, `isolation`, `events` |
| the paper's ode15s | scipy's BDF and others, same equations and margins | `scipy_solvers` |
| - | what no correct run can show | `invariants` |

The way of a run: `simulation` > `running` > `integrate` (steps, ended by events), which records rows
(`recording`) of the nodes of a step (`dop853`); `observation` makes channels, extrema (`results`), energies
and reactions (`balance`) of them, many at a time. Of the kernels (`compiled`) only those decorated as
`kernel` may be called from Python.
"""

from reference_model.results import Result
from reference_model.simulation import simulate

__all__ = ["Result", "simulate"]
