"""A planar six-bar press in Exudyn, with clearance between slider and guide.

Written without knowledge of ``reference_model``; the two share only the scene's numbers. Equation, figure and
table numbers are those of Zuo et al., Lubricants 2025, 13(6), 246; the equations stand in ``docs/model.md``.

| equations | content | module |
|---|---|---|
| Fig. 4, Tables 1, 2 | a scene's numbers, and the solver's settings | `parameters` |
| Eq. 16, rows 1-8; t = 0 | driven four-bar in closed form, initial state | `linkage` |
| Eqs. 1-6; Figs. 7, 8 | corners and walls; crank pin A; impact speeds and times | `clearances` |
| Eqs. 7-13 | the laws of a side of the slider, modified Coulomb friction | `laws` |
| - | load of a workpiece, its forces in a turn of the crank | `workpiece` |
| Eqs. 14-21 | bodies with joints, from lists, implicit; also any linkage of a scene | `five_bodies` |
| Eqs. 14-21, reduced | coordinates that the drive leaves free, explicit | `tree` |
| - | channels, extrema by cycle, contacts and their pulses | `tables` |
| - | call of Exudyn's solver, results before they are judged | `run` |
| - | invariants of every correct run | `invariants` |

A run passes from `simulation` to the `solver` of one formulation, whose kernels fill the arrays that its
`recording` observes. Kernels read records of named numbers; `kernels` compiles them and stores their machine
code for this version of the package.
"""

from exudyn_model.simulation import Result, simulate

__all__ = ["Result", "simulate"]
