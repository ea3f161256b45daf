"""Taylor series from one switch of the right-hand side to the next, each located as a terminal event."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import heyoka as hy
import numpy as np

from truth_press.arithmetic import Arithmetic
from truth_press.press import CORNERS, FREE, INTEGRALS, SLOT, Press

PIECES = 100
"""Pieces of a cycle: for the progress, and to bound the memory."""
ROUNDING = 1e-15
"""Depth (m) up to which a corner on its wall at the start is not inside it."""
LIMIT = 1_000_000
"""Steps of a cycle after which a run is stopped: fifty times those of the shipped scenes."""


class Phase:
    """The equations with a number of closed contacts, compiled."""

    def __init__(self, press: Press, arithmetic: Arithmetic, n_closed: int, tolerance: float) -> None:
        rates, distances, outputs = press.equations(n_closed)
        options, variables = arithmetic.options | {"compact_mode": True}, hy.make_vars(*rates)
        event_options: Any = {"direction": hy.event_direction.negative, "fp_type": options["fp_type"]}
        events = [hy.t_event(value, **event_options) for value in distances.values()]
        system, start = list(zip(variables, rates.values(), strict=True)), arithmetic.array([0] * len(rates))
        tol = arithmetic.number(tolerance)
        self.taylor = hy.taylor_adaptive(system, start, t_events=events, tol=tol, **options)
        self.states, self.surfaces, self.n_closed = list(rates), list(distances), n_closed
        self.rows = {name: row for row, name in enumerate(outputs)}
        self.outputs = hy.cfunc(list(outputs.values()), variables, **options)
        self.distances = hy.cfunc(list(distances.values()), variables, **options)


def evaluate(function: Any, states: Any, pars: Any, times: Any) -> Any:
    """Return the values of a compiled function, of shape (values, times), at states of (times, states)."""
    pars = np.repeat(pars[: function.nparams, None], len(times), axis=1)
    return function(np.ascontiguousarray(states.T), pars=np.ascontiguousarray(pars), time=times)


class Segment(NamedTuple):
    """Solution between two switches: called with times (s) it returns states, of shape (times, states)."""

    phase: Phase
    solution: Any
    pars: Any
    slots: tuple[int, ...]
    """The corner in each slot."""
    times: Any
    """Ends of the steps, s."""


class Motion:
    """State of the press, memory of its contacts, and the way from switch to switch."""

    def __init__(self, press: Press, arithmetic: Arithmetic, tolerance: float) -> None:
        self.press, self.arithmetic, self.tolerance = press, arithmetic, tolerance
        zero, one, friction = press.zero, press.one, press.scene["friction"]
        v0, v1 = friction["static_speed"], friction["transition_speed"]
        self.speeds, slope = [-v1, -v0, v0, v1], 1 / (v1 - v0)
        self.regimes = [(-one, zero), (v0 * slope, slope), (zero, zero), (-v0 * slope, slope), (one, zero)]
        """Friction fa + fb v_t between those speeds."""
        self.cycle = 60 / abs(press.scene["drive"]["speed_rpm"])
        self.phases: dict[int, Phase] = {}
        self.contacts: list[dict[str, Any]] = []
        """Quantities recorded of each contact, with the parameters of its slot and its regime of friction."""
        self.closed: dict[int, dict[str, Any]] = {}
        """Of ``contacts`` that of each closed corner."""
        self.pieces, self.piece = press.pieces(), 0
        self.t, self.switches, self.steps = zero, 0, 0
        dummy = hy.make_vars("none")
        start = hy.cfunc([*press.initial(), 0.0 * dummy + hy.time], [dummy], **arithmetic.options)
        self.state = dict(zip(FREE, start(arithmetic.array([0]), time=zero), strict=False))
        self.state |= dict.fromkeys(INTEGRALS, zero) if press.energies else {}
        self._settle()

    def phase(self) -> Phase:
        """Return the equations that hold now."""
        count = len(self.closed)
        if count not in self.phases:
            self.phases[count] = Phase(self.press, self.arithmetic, count, self.tolerance)
        return self.phases[count]

    def slots(self) -> tuple[int, ...]:
        """Return the corners, the closed ones first."""
        return tuple(sorted(range(4), key=lambda corner: (corner not in self.closed, corner)))

    def values(self) -> Any:
        """Return the state in the order of the phase."""
        impulses = {f"impulse{k}": self.closed[c]["impulse"] for k, c in enumerate(sorted(self.closed))}
        return self.arithmetic.array([(self.state | impulses)[name] for name in self.phase().states])

    def parameters(self) -> Any:
        """Return the parameters that hold now."""
        slider, one = self.press.bodies["slider"], self.press.one
        values = list(self.pieces[self.piece].values()) if self.pieces else []
        for corner in self.slots():
            x, y = 2 * (corner % 2) - 1, 2 * (corner // 2) - 1
            place = {"sx": x * slider["width"] / 2, "sy": y * slider["length"] / 2, "sigma": -x * one}
            slot = self.closed.get(corner, {}) | place
            values += [slot.get(name, self.press.zero) for name in SLOT]
        return self.arithmetic.array(values)

    def now(self) -> dict[str, Any]:
        """Return the recorded values at this time, by name; those of a corner have its number."""
        phase, slots, time = self.phase(), self.slots(), self.arithmetic.array([self.t])
        values = evaluate(phase.outputs, self.values()[None], self.parameters(), time)[:, 0]
        names = (f"{n[:-1]}{slots[int(n[-1])]}" if n[-1].isdigit() else n for n in phase.rows)
        return dict(zip(names, values, strict=True))

    def _settle(self) -> None:
        """Close the corners that are inside their walls at the start, and find the piece of the load."""
        now = self.now()
        for corner in range(4):
            gap = now[f"gap{corner}"]
            if gap < -ROUNDING or (gap <= 0 and now[f"rate{corner}"] > 0):
                self._close(corner, now)
        depth = self.press.load["surface"] - now["slider_y"]
        while self.pieces and depth > self.pieces[self.piece]["high"]:
            self.piece += 1

    def _close(self, corner: int, now: dict[str, Any]) -> None:
        zero, one, rate = self.press.zero, self.press.one, now[f"rate{corner}"]
        impact = max(rate, self.press.contact["impact_speed_floor"])
        deep = -now[f"gap{corner}"] > self.press.contact["damping_depth"]
        contact = {"corner": CORNERS[corner], "start": self.t, "normal_speed": impact, "impulse": zero}
        contact |= {"live": one, "deep": one if deep else zero, "v": impact, "per_v": one / impact}
        contact |= {"peak_force": 0.0, "largest_depth": 0.0}
        self._regime(contact, sum(bool(now[f"slip{corner}"] > speed) for speed in self.speeds))
        self.closed[corner] = contact
        self.contacts.append(contact)
        if rate < 0 and self.now()[f"normal{corner}"] < 0:  # inside at the start, and on its way out
            contact["live"] = zero

    def _regime(self, contact: dict[str, Any], regime: int) -> None:
        zero, one = self.press.zero, self.press.one
        contact["regime"], (contact["fa"], contact["fb"]) = regime, self.regimes[regime]
        contact["down"], contact["low"] = (one, self.speeds[regime - 1]) if regime > 0 else (zero, -one)
        contact["up"], contact["high"] = (one, self.speeds[regime]) if regime < 4 else (zero, one)

    def run(self, end: Any) -> Iterator[Segment]:
        """Integrate to an end, s; the caller has each segment before its switch."""
        cycles, piece = max(1, round(float(end / self.cycle))), 1
        while self.t < end:
            phase, slots, pars, taylor = self.phase(), self.slots(), self.parameters(), self.phase().taylor
            taylor.time, taylor.state[:], taylor.pars[:] = self.t, self.values(), pars[: len(taylor.pars)]
            taylor.reset_cooldowns()
            # The last piece ends exactly there: end * n / n can be less, and one more would be beyond.
            until = end * piece / (PIECES * cycles) if piece < PIECES * cycles else end
            outcome, _, _, steps, solution, *_ = taylor.propagate_until(until, c_output=True)
            outcome, before, self.t, self.steps = int(outcome), self.t, taylor.time, self.steps + steps
            if not np.isfinite(float(np.sum(taylor.state))):
                raise ArithmeticError(f"not finite after {float(before):g} s")
            if self.steps + self.switches > LIMIT * cycles:
                raise ArithmeticError(f"{self.steps} steps up to {float(self.t):g} s")
            self.state = dict(zip(phase.states, list(taylor.state), strict=True))
            for slot, corner in enumerate(slots[: phase.n_closed]):
                self.closed[corner]["impulse"] = self.state.pop(f"impulse{slot}")
            ties = set()
            if self.t > before:
                segment = Segment(phase, solution, pars, slots, solution.times)
                yield segment
                ties = self._ties(segment)
            if outcome == int(hy.taylor_outcome.time_limit):
                piece += 1
            else:
                self._switch(sorted({phase.surfaces[-1 - outcome]} | ties), slots)

    def _ties(self, segment: Segment) -> set[tuple[str, int]]:
        """Return the surfaces passed at the end of a segment: heyoka reports one of several at an instant.

        A corner that approaches is at its wall where it will be there within so many seconds as the starting
        depth has metres.
        """
        end, phase = segment.times[-1], segment.phase
        back = (end - segment.times[-2]) / 1024
        times = self.arithmetic.array([end - back, end])
        distances = evaluate(phase.distances, segment.solution(times), segment.pars, times)
        return {
            name
            for name, (before, after) in zip(phase.surfaces, distances, strict=True)
            if after < before and after * back <= (before - after) * self.press.depth
        }

    def _switch(self, surfaces: list[tuple[str, int]], slots: tuple[int, ...]) -> None:
        """Pass surfaces: corners close and open, regimes change."""
        now, one = self.now(), self.press.one
        self.switches += len(surfaces)
        for kind, slot in surfaces:
            contact, step = self.closed.get(slots[slot], {}), -1 if kind in ("slower", "load-low") else 1
            if kind in ("faster", "slower"):
                skipped = contact["regime"] + step == 2 and self.speeds[1] == self.speeds[2]
                self._regime(contact, contact["regime"] + step * (2 if skipped else 1))
            elif kind in ("clip", "depth"):
                key = "live" if kind == "clip" else "deep"
                contact[key] = one - contact[key]
            elif kind.startswith("load"):
                self.piece += step
                piece = self.pieces[self.piece]
                self.piece += step if piece["high"] - piece["low"] < self.press.depth else 0
        for slot in (slot for kind, slot in surfaces if kind == "part"):
            self.closed.pop(slots[slot])["end"] = self.t
        for slot in (slot for kind, slot in surfaces if kind == "touch"):
            self._close(slots[slot], now)
