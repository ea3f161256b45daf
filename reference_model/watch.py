"""What no correct run can show, watched in every run: each invariant's worst value, its time and its bound.

The values are taken from the contacts' states at the ends of accepted steps, not from what located the
events. How deep an open contact is inside its wall is taken from the samples too, where they have forces:
within a step they show a contact that was stepped over. A run in which one is outside its bound gets the
status `invariant-violated`.
"""

from reference_model.compiled import bare, inlined, kernel
from reference_model.constants import PAPER_SWITCHING, Constants
from reference_model.forces import CONTACTS, FRICTION, GAP, INSIDE, NORMAL, SLIP, Array
from reference_model.journal import JOURNAL

OPEN_DEPTH, PULL, DRIVING_FRICTION, LEAVING_START, START_GAP, ENERGY, LARGEST_FORCE, LARGEST_ENERGY = range(8)
"""Rows of the watch; the largest normal force and energy are no invariants, but the measures of others."""
WATCHED = 8
WORST, TIME, CONTACT = 0, 1, 2
"""Columns of the watch."""


@bare
def _note(watch: Array, row: int, value: float, t: float, contact: int) -> None:
    if not value <= watch[row, WORST]:  # nan counts
        watch[row, WORST], watch[row, TIME], watch[row, CONTACT] = value, t, contact


@inlined
def watch_open(modes: Array, contacts: Array, t: float, watch: Array) -> None:
    """Note depths outside contacts; parameters as of `watch_contacts`."""
    for k in range(CONTACTS):
        if modes[INSIDE, k] == 0.0 and -contacts[GAP, k] > watch[OPEN_DEPTH, WORST]:
            _note(watch, OPEN_DEPTH, -contacts[GAP, k], t, k)


@inlined
def watch_contacts(modes: Array, contacts: Array, t: float, watch: Array) -> None:
    """Note depths outside contacts, pulls and driving friction of one state.

    Parameters
    ----------
    modes, contacts
        Modes (MODES, CONTACTS) and states (5, CONTACTS) of the contacts.
    t
        s.
    watch
        Updated, shape (WATCHED, 3): worst value, time (s) and contact of each invariant.
    """
    watch_open(modes, contacts, t, watch)
    for k in range(CONTACTS):
        if modes[INSIDE, k] == 0.0 and contacts[NORMAL, k] == 0.0:
            continue
        normal = contacts[NORMAL, k]
        if normal > watch[LARGEST_FORCE, WORST]:
            _note(watch, LARGEST_FORCE, normal, t, k)
        elif -normal > watch[PULL, WORST]:
            _note(watch, PULL, -normal, t, k)
        if normal < 0.0:  # its friction drives, too: that is the same violation
            continue
        power = contacts[FRICTION, k] * contacts[SLIP, k]
        if k == JOURNAL:  # there it is the drag on the bearing
            power = -power
        if power > watch[DRIVING_FRICTION, WORST]:
            _note(watch, DRIVING_FRICTION, power, t, k)


@kernel
def watch_start(gap: float, rate: float, t: float, contact: int, watch: Array) -> None:
    """Note gap (m) and rate (m/s) at which a contact begins; what is inside at t = 0 may leave."""
    if t > 0.0:
        _note(watch, START_GAP, abs(gap), t, contact)
        _note(watch, LEAVING_START, rate, t, contact)


@kernel
def watch_energy(c: Constants, energies: Array, start: Array, t: float, watch: Array) -> None:
    """Note the relative residual of the balance of `reference_model.energy`, where there is a potential.

    Relative to the largest so far of what damping and friction have taken, the kinetic energy and the work of
    gravity: where nothing is lost the balance is no more accurate than what flows through it.
    """
    if c.law == PAPER_SWITCHING:
        return
    _note(
        watch, LARGEST_ENERGY, max(energies[4] + energies[5], start[0], energies[2], abs(energies[1])), t, -1
    )
    _note(watch, ENERGY, abs(energies[6]) / watch[LARGEST_ENERGY, WORST], t, -1)
