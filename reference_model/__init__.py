"""The hand-written solver of the paper's equations.

| equations | what | where |
|---|---|---|
| Fig. 4, Table 1 | the mechanism's numbers | `parameters`, read by `reading`; for the kernels: `constants` |
| rows 1-8 of Eq. 16 | driven four-bar in closed form | `linkage`; all bodies: `bodies`; none free: `ideal` |
| Eqs. 1-6 | corners, walls, gaps | `contact` |
| Eqs. 7-8 | surface contact (and the strip that replaces it) | `contact` |
| Eqs. 7-8 | the same continued to a part of the side | `foundation` |
| Eqs. 9-11 | point contact with damping | `contact`; memory of the impact speed (if any): `progress` |
| Eqs. 12-13 | modified Coulomb friction | `friction` |
| Figs. 7, 8 | clearance at the crank pin A | `journal` |
| Eqs. 14-21 | coordinates and multipliers, Baumgarte | `multiplier` |
| their projections | the fewest coordinates | `minimal` (slider), `chain` (crank pin, both) |
| the paper's ode15s | scipy's BDF and others, same equations and events | `scipy_solvers`, `dense_events` |
| - | steps at a touch, peaks of depth and force within a step | `contact_steps`, `peaks` |
| - | where a mode ends | `switching`; most steps hold no end: `step_bounds`; search: `isolation`, `events` |
| - | what no correct run can show | `watch`, judged by `invariants` |

The way of a run: `simulation` > `start` > `integrate` (steps of `dop853`, ended by `events`) > `observation`
(with `reactions` and `energy` where a scene asks for them). `formulations` binds one set of equations to it.
"""

from reference_model.simulation import Result, simulate

__all__ = ["Result", "simulate"]
