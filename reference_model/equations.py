"""One interface to the equations of motion of all formulations.

Which of them stands for a function of this module follows, when a kernel is compiled, from the type of the
model: numba compiles the integrator once for each that is used, so a scene pays only for the coordinates that
it leaves free. The functions themselves are stubs, for names, arguments and types.
"""

from collections.abc import Callable
from typing import Any

import numba.extending

from reference_model import chain, minimal, multiplier
from reference_model.chain import Chain
from reference_model.compiled import ONLY_FROM_KERNELS
from reference_model.linkage import Array
from reference_model.minimal import Minimal
from reference_model.multiplier import Linkage
from reference_model.state import Nodes, Records

Model = Minimal | Chain | Linkage
_MODULES: dict[type, Any] = {Minimal: minimal, Chain: chain, Linkage: multiplier}


def _overload(stub: Callable[..., Any]) -> None:
    """Let the function of the same name in the model's module stand for a stub, inlined."""
    options = {**ONLY_FROM_KERNELS, "forceinline": True}

    @numba.extending.overload(stub, jit_options=options, strict=False)  # type: ignore[untyped-decorator]
    def function(*arguments: Any) -> Any:
        return getattr(_MODULES[arguments[0].instance_class], stub.__name__)


def tabulate(model: Model, t: float, h: float, shares: Array) -> None:
    """Prepare what of the motion is a function of time alone, for all times t + shares h (s)."""
    raise NotImplementedError


def motion(model: Model, t: float, i: int, nodes: Nodes) -> None:
    """Write gaps, rates and slips of the contacts in the state of node `i` at `t` (s)."""
    raise NotImplementedError


def derivative(model: Model, t: float, i: int, modes: Records, nodes: Nodes) -> None:
    """Evaluate the equations of motion in frozen modes at `t` (s), one of the times given to `tabulate`.

    Of the state at node `i` coordinates and rates are given; written are the derivative of the whole state,
    the contacts' states and the slider's motion.
    """
    raise NotImplementedError


for _stub in (tabulate, motion, derivative):
    _overload(_stub)
