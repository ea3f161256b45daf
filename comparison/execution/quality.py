"""Quality checks of finished runs: resolution of contacts, spurious energy, constraints, indentation."""

from math import nan

import numpy as np

from comparison.formatting import number, percent, quantity
from comparison.tables.table import Table

FEW_STEPS = 10.0
"""In so many steps a contact's force still has its course; with fewer its impulse depends on where the
touch falls within a step (the study extremes measures by how much)."""
MUCH_ENERGY = 0.01
"""Of the dissipated energy; equivalent to a change of the restitution by half a percent."""
MUCH_DRIFT = 1e-6
"""m or rad: as deep as corners of steel dip into a wall; of rates a thousand times as much, as for errors."""


def steps_per_contact(table: Table) -> float:
    """Return steps per contact, their median weighted by peak force; nan without contacts or a fixed step."""
    step, contacts = table.provenance.get("settings", {}).get("step_used"), table.events
    if step is None or contacts is None or not len(contacts):
        return nan
    lengths = np.asarray(contacts["end"] - contacts["start"], dtype=np.float64)
    forces = np.asarray(contacts["peak_force"], dtype=np.float64)
    if not forces.sum() > 0.0:
        return nan
    # Long contacts with little force must not offset short impacts.
    return float(np.quantile(lengths, 0.5, weights=forces, method="inverted_cdf")) / float(step)


def energy_share(table: Table) -> float:
    """Return the largest spurious energy over the dissipated, else over the kinetic; nan if not recorded."""
    if "energy_residual" not in table.names or not len(table.time):
        return nan
    lost = float((table.values("energy_damping") + table.values("energy_friction"))[-1])
    base = lost if lost > 0.0 else float(table.values("energy_kinetic").max())
    return float(np.abs(table.values("energy_residual")).max()) / base if base > 0.0 else nan


def contact_warnings(table: Table) -> list[str]:
    """Return a line if a measure of a contact is zero in every contact: the model does not record it."""
    events = table.events
    if events is None or not len(events):
        return []
    measures = ("normal_speed", "impulse", "peak_force", "largest_depth")
    zero = [name for name in measures if name in events and not events[name].to_numpy().any()]
    said = f"{', '.join(zero)} of all its {len(events)} contacts are zero: these are not recorded, it seems"
    return [said] if zero else []


def quality_warnings(table: Table) -> list[str]:
    """Return one line for each quality check that a finished run fails."""
    lines = []
    if (steps := steps_per_contact(table)) < FEW_STEPS:
        lines.append(
            f"half of its contacts, weighted by force, last less than {number(steps, 2)} steps; accurate "
            f"impulses require at least {FEW_STEPS:g}: reduce solver.exudyn.step, or use "
            "solver.exudyn.formulation = 'tree'"
        )
    if (share := energy_share(table)) > MUCH_ENERGY:
        lines.append(f"spurious energy is {percent(share)} of the dissipated energy: refine the solver")
    drift = table.provenance.get("constraints", {})
    position, velocity = drift.get("position", 0.0), drift.get("velocity", 0.0)
    if position > MUCH_DRIFT or velocity > 1e3 * MUCH_DRIFT:
        lines.append(
            f"its constraints are violated by up to {quantity(position, 'm')}, {quantity(velocity, 'm/s')}: "
            "refine the solver, and keep Baumgarte's gains below a tenth of one over its largest step"
        )
    lines += contact_warnings(table)
    radius = table.provenance.get("scene", {}).get("contact", {}).get("corner_radius")
    if radius is not None and table.events is not None:
        depth = float(table.events["largest_depth"][table.events["corner"] != "pin"].max())
        if depth > radius:  # nan without a contact
            lines.append(
                f"a corner is pressed {quantity(depth, 'm')} into the wall, deeper than its radius "
                f"contact.corner_radius = {radius:g} m: the contact law is not valid there"
            )
    return lines
