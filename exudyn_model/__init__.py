"""A planar six-bar press in Exudyn, with clearance between slider and guide.

Written without knowledge of ``reference_model``; the two share only the scene's numbers. Equation, figure and
table numbers are those of Zuo et al., Lubricants 2025, 13(6), 246.

| equations | what | where |
|---|---|---|
| Fig. 4, Tables 1, 2 | the press's numbers | `parameters`, read by `reading`; for the kernels: `constants` |
| - | formulation, method and settings of a scene | `solver_choice` |
| Eq. 16 | bodies and pins; their violation | `bodies`; `five_bodies.constraints` |
| Eq. 16 at t = 0 | initial positions and velocities | `assembly` |
| Eq. 20 at t = 0 | initial accelerations and reactions | `five_bodies.initial_accelerations` |
| rows 1-8 of Eq. 16 | driven four-bar in closed form | `linkage` |
| Eqs. 1-6 | corners, walls, gaps | `contact.gaps`; resultant: `contact.corners` |
| Eqs. 7-8 | surface contact (and the strip or the foundation that replaces it) | `contact.laws` |
| - | a side on an elastic foundation as one contact | `contact.foundation` |
| Eqs. 9-11 | point contact with damping, by the frozen speed or the current one | `contact.point` |
| - | speed at a touch inside a step | `contact.impact_speed` |
| - | memory of the impact speeds | `contact.states`, `contact.memory` |
| Eqs. 12-13 | modified Coulomb friction | `contact.friction` |
| Figs. 7, 8 | clearance at the crank pin A | `contact.journal` |
| Eqs. 14-21 | five bodies with joints, implicit | `five_bodies.mechanism`, `five_bodies.solver` |
| - | their steps, short in contacts and long in flight | `five_bodies.step_choice`, `five_bodies.foresight` |
| Eqs. 9-13 again | Exudyn's own contact object | `five_bodies.native_contact` |
| Eqs. 14-21, reduced | what the drive leaves free, explicit | `tree.slider_tree`, `tree.rocker_tree` |
| the same | accelerations by balance of forces | `accelerations`, `free_rocker` |
| - | error control of a tree, steps that end at a touch | `tree.solver`, `tree.steps` |
| - | where a contact begins or ends in a step | `tree.switching`, `tree.isolation`, `tree.step_bounds` |
| - | work, stored and dissipated energy | `energy` |
| - | what no correct run can show | `watch`, `seen`, judged by `invariants` |

The way of a run: `simulation` > `five_bodies.run` or `tree.run` > `solver` > `recording` of the same room,
which keeps what `observation` fills of each accepted state. `channels` names the channels, `tables` makes the
tables of extrema and contacts, `pulses` that of their forces in time, `compiled` the machine code, which
`kernel_files` keeps for this version of the package.
"""

from exudyn_model.simulation import Result, simulate

__all__ = ["Result", "simulate"]
