"""Results in a notebook: a model's result as a table, which a notebook shows and draws.

>>> from comparison.report.pictures.notebook import tabulated
>>> from comparison.scene import load_scene
>>> from reference_model import simulate
>>> table = tabulated(simulate(load_scene("ideal").data))
>>> table.frame["slider_y"].abs().max() > 0
True
"""

import html
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import pandas as pd

from comparison.execution.run import Progress, run_one
from comparison.formatting import number
from comparison.models import EngineError
from comparison.report.figures import Picture, picture
from comparison.report.plots import table_extremes
from comparison.scene import Scene, as_scene
from comparison.scene.keys import short
from comparison.tables.table import Table, TableError


@dataclass(frozen=True, repr=False)
class RunTable(Table):
    """A `comparison.tables.table.Table` that notebooks show and that draws its channels."""

    def plot(self, *names: str, other: Table | None = None) -> Picture:
        """Draw channels over time, a panel each, by default the slider's x; another table over this one."""
        tables: dict[str, Table] = {str(self.provenance.get("model", "this run")): self}
        if other is not None and not isinstance(other, Table):
            raise TableError(f"other = {short(other)} must be a table, such as sixbar.simulate returns")
        if other is not None:
            label = str(other.provenance.get("model", "other run"))
            tables[label if label not in tables else f"{label} (other)"] = other
        return picture(tables, names or ("slider_x",))

    def _repr_html_(self) -> str:
        definitions = self.definitions
        extremes = [map(number, table_extremes(self, name)) for name in self.channels]
        rows = pd.DataFrame(extremes, columns=["smallest", "largest"])
        rows.insert(0, "channel", self.channels)
        rows.insert(1, "unit", [definitions[n].unit if n in definitions else "" for n in self.channels])
        status = self.provenance.get("status", "")
        contacts = "" if self.events is None else f", {len(self.events)} contacts"
        end = f"{number(float(self.time[-1]))} s{contacts}" if len(self.frame) else "none"
        head = f"{self.provenance.get('model', 'run')}{': ' if status else ''}{status}; "
        head += f"{len(self.frame)} samples to {end}"
        return f"<p>{html.escape(head)}</p>{rows.to_html(index=False, border=0)}"


def tabulated(result: Any) -> RunTable:
    """Return the table of a model's result; raise `TableError` if it is incomplete."""
    return RunTable.from_result(result)


def simulate(
    scene: Scene | str | Path, model: str = "reference", progress: Progress | None = None
) -> RunTable:
    """Run a scene by one model, in this process.

    Parameters
    ----------
    scene
        A shipped name, a path, or a scene of `sixbar.load_scene`.
    model
        "reference", "exudyn" or one of another package.
    progress
        Called with the finished share, 0 to 1.

    Returns
    -------
    RunTable
        ``frame``: time (s) and channels, a row a sample; ``events``: a row a contact; ``extrema`` of each
        channel between samples too; ``provenance``: settings and versions; ``plot("slider_x")``. A notebook
        shows it.

    Raises
    ------
    SceneError
        If the model refuses the scene.
    RunError
        If the run does not succeed; its ``outcome`` says why.

    Examples
    --------
    >>> import sixbar
    >>> scene = sixbar.load_scene("150rpm-0.2mm", {"drive.cycles": 0.1})
    >>> run = sixbar.simulate(scene)
    >>> len(run.frame), len(run.events)
    (101, 7)
    """
    scene = as_scene(scene)
    if not isinstance(model, str):
        raise EngineError(f"model {model!r} must be a name")
    run = run_one(scene, model, progress)
    criteria = {"reliability": scene.reliability.model_dump()}
    parts = {part.name: getattr(run, part.name) for part in fields(run)}
    return RunTable(**parts | {"provenance": run.provenance | criteria})
