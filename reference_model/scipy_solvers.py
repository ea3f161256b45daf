"""The equations of motion integrated by scipy's `solve_ivp`, from event to event.

The paper integrates its 15 coordinates with a variable-order backward differentiation formula (MATLAB's ode15s),
which is BDF here. Every margin of `reference_model.margins` is a terminal event of `solve_ivp`, so the modes change
as in `reference_model.integrate`; after every event the solver starts anew.

What that misses: scipy looks for an event only where a margin has opposite signs at the two ends of a step. A
contact that begins and ends within one step is stepped over (`reference_model.integrate` isolates it for certain),
and so is whatever else turns twice. Steps of at most a fiftieth of a cycle make that rare, not impossible. Of two
events in one step the first is taken. A mode that is still past its end where the solver starts has ended once more.
"""

import math
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

from reference_model import integrate, simulation
from reference_model.compiled import kernel
from reference_model.contact import CONTACTS, MEMORY, TAIL, no_contacts, normal_force
from reference_model.dop853 import STAGES, VELOCITY_TIME
from reference_model.equations import Model, evaluate
from reference_model.events import ENDED, PEAK, DEPTH, RECORDED, SAMPLES, STEPS, SWITCHES, Run, end_contact, note_forces, switch
from reference_model.linkage import Array
from reference_model.margins import MARGINS, margin
from reference_model.parameters import Law, Parameters
from reference_model.recording import EXTREMUM, MARKS, SAMPLE, STEP, record

RTOL = 100.0 * float(np.finfo(np.float64).eps)
"""The smallest that scipy takes. The tolerance of a scene is absolute: that a coordinate is 0.55 m long makes no
larger error of it harmless, as a contact is only some 1e-6 m deep."""
_UNCONTROLLED = 1e30
"""Tolerance of the impulses and works: as in `integrate` they are quadratures, whose errors do not act back. Not
infinite, as LSODA divides by its inverse."""
_POSITION, _VELOCITY = 1e-9, 1e-6
"""Increments of the Jacobian, m or rad and m/s or rad/s. Contacts are some um deep, so a thousandth of that leaves
both the curvature of the force and the round-off of the gap (1e-16 m) below 1e-3 of it: plenty for Newton."""
