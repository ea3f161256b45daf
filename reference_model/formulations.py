"""The formulations of a scene: choice, start, equations of motion, and the bodies of a state.

Which of them stands for `tabulate`, `motion` and `derivative` follows, when a kernel is compiled, from the
type of the model: numba compiles the integrator once for each that is used, so a scene pays only for the
coordinates that it leaves free. Here these three are stubs, for names, arguments and types.
"""

from collections.abc import Callable
from typing import Any

import numba.extending
import numpy as np

from reference_model import chain, minimal, multiplier
from reference_model.chain import Chain
from reference_model.compiled import ONLY_FROM_KERNELS
from reference_model.linkage import (
    Array,
    Mechanism,
    bodies_from_rods,
    four_bar_rods,
    rod4_from_slider,
    rod4_of_ideal_slider,
    turning,
)
from reference_model.minimal import Minimal
from reference_model.multiplier import Linkage
from reference_model.parameters import Parameters
from reference_model.state import WORKS, Nodes, Records, contact_list

Model = Minimal | Chain | Linkage
_MODULES: dict[type, Any] = {Minimal: minimal, Chain: chain, Linkage: multiplier}


def _overload(stub: Callable[..., Any]) -> None:
    """Let the function of the same name in the model's module stand for a stub, inlined."""
    options = {**ONLY_FROM_KERNELS, "forceinline": True}

    @numba.extending.overload(stub, jit_options=options, strict=False)  # type: ignore[untyped-decorator]
    def function(*arguments: Any) -> Any:
        return getattr(_MODULES[arguments[0].instance_class], stub.__name__)


def tabulate(model: Model, t: float, h: float, shares: Array) -> None:
    """Prepare the part of the motion that depends on time alone, for all times t + shares h (s)."""
    raise NotImplementedError


def motion(model: Model, t: float, i: int, modes: Records, nodes: Nodes) -> None:
    """Write gaps, rates and slips of the contacts in the state of node `i` at `t` (s)."""
    raise NotImplementedError


def derivative(model: Model, t: float, i: int, modes: Records, nodes: Nodes) -> None:
    """Evaluate the equations of motion in frozen modes at `t` (s), one of the times given to `tabulate`.

    The input is coordinates and rates of node `i`; the output is the derivative of the whole state, the
    contacts' states and the slider's motion.
    """
    raise NotImplementedError


for _stub in (tabulate, motion, derivative):
    _overload(_stub)


def formulation(p: Parameters) -> tuple[Model, str]:
    """Return the smallest formulation for a scene, or the paper's if the scene asks for it, and its name."""
    m, contacts, load = p.mechanism, contact_list(p.contacts), p.load
    if p.multipliers:
        model = multiplier.press(m, contacts, load, baumgarte=(p.alpha, p.beta))
        return model, f"multiplier (15 coordinates, {model.rows} multipliers)"
    if p.ideal_pin:
        return minimal.minimal(m, contacts, load), "minimal: rod 4 and slider (2 coordinates)"
    free = "rod 2 and rocker (2" if p.ideal_slider else "rod 2, rocker, rod 4 and slider (4"
    return Chain(m, contacts, load, p.ideal_slider), f"minimal: {free} coordinates)"


def start(p: Parameters, model: Model) -> Array:
    """Return coordinates and rates at t = 0, as a state of the model begins with them.

    The crank, rod 2 and the rocker start as in the ideal mechanism, so a pin with clearance is centred. The
    slider starts where the scene puts it; rod 4 connects them, and the slider's y and vy follow.
    """
    m = p.mechanism
    theta4, w4 = rod4_from_slider(m, *p.slider_start)
    rod2, rocker = four_bar_rods(m, np.zeros(1))
    if isinstance(model, Minimal):
        return np.array([theta4, p.slider_angle, w4, p.slider_omega])
    if isinstance(model, Linkage):
        slider = p.slider_angle, p.slider_omega, 0.0
        bodies = bodies_from_rods(m, np.zeros(1), (rod2, rocker, turning(theta4, w4, 0.0)), slider)[:, :, 0]
        return np.concatenate([bodies[:, :3].ravel(), bodies[:, 3:6].ravel()])
    theta2, theta3, w2, w3 = (float(rod[i][0]) for i in (2, 3) for rod in (rod2, rocker))
    if model.ideal_slider:
        return np.array([theta2, theta3, w2, w3])
    return np.array([theta2, theta3, theta4, p.slider_angle, w2, w3, w4, p.slider_omega])


def all_bodies(model: Model, m: Mechanism, times: Array, y: Array, dy: Array) -> Array:
    """Return the motion of all bodies, shape (5, 9, n), from states and their derivatives, shape (size, n).

    `times` count from the start of a cycle, s.
    """
    n = (len(y) - model.contacts.size - WORKS) // 2
    q, v, a = y[:n], y[n : 2 * n], dy[n : 2 * n]
    if isinstance(model, Linkage):
        return np.concatenate([part.reshape(n // 3, 3, -1) for part in (q, v, a)], axis=1)
    turns = list(zip(q, v, a, strict=True))
    if isinstance(model, Minimal):
        rods = (*four_bar_rods(m, times), turning(*turns[0]))
        return bodies_from_rods(m, times, rods, turns[1])
    rod2, rocker = turning(*turns[0]), turning(*turns[1])
    if model.ideal_slider:
        return bodies_from_rods(m, times, (rod2, rocker, rod4_of_ideal_slider(m, rocker)), (0.0, 0.0, 0.0))
    return bodies_from_rods(m, times, (rod2, rocker, turning(*turns[2])), turns[3])
