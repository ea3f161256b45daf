"""Comparison of two tables in one call, for Python."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from comparison.scene import Scene
from comparison.tables.foreign import as_source
from comparison.tables.mapping import Mapping, load_mapping
from comparison.tables.table import Table
from comparison.verdict.recorded import compare_files
from comparison.verdict.results import SceneComparison


def compare(
    a: Table | pd.DataFrame | str | Path,
    b: Table | pd.DataFrame | str | Path,
    *,
    scene: Scene | None = None,
    tolerance: float | None = None,
    share: float = 1.0,
    mapping: Mapping | str | Path | None = None,
    labels: Sequence[str] = ("a", "b"),
    **options: Any,
) -> SceneComparison:
    """Compare two tables, channel by channel, with a tolerance.

    Parameters
    ----------
    a, b
        Tables such as `sixbar.simulate` returns, data frames with a column ``time`` (s), or paths, also of
        other programs' files.
    scene
        Gives the scales of the channels; None: the scene recorded in both tables, else scales are ranges.
    tolerance
        Largest difference, as a share of each channel's scale; None: that of the scene. With neither the
        verdict is "indeterminate".
    share
        Of the samples, that must be within the tolerance.
    mapping
        Of the columns of files to channels, or the path of a mapping file.
    labels
        What messages call the two.
    options
        Others of `comparison.verdict.recorded.compare_files`: ``channels``, ``tolerances``, ``absolute``,
        ``time_tolerance``, ``abscissa``, ``common_time``, ``apply_shift``.

    Returns
    -------
    SceneComparison
        ``verdict``: "agree", "differ" or "indeterminate"; ``channels``: name -> its own verdict, largest and
        RMS difference, metrics; ``warnings``.

    Raises
    ------
    TableError
        If the tables cannot be read or compared.

    Examples
    --------
    >>> import sixbar
    >>> scene = sixbar.load_scene("150rpm-0.2mm", {"drive.cycles": 0.02})
    >>> run = sixbar.simulate(scene)
    >>> moved = run.frame.assign(slider_x=run.frame["slider_x"] + 1e-6)  # 0.5 % of the clearance
    >>> comparison = sixbar.compare(run, moved, scene=scene, tolerance=1e-3)
    >>> comparison.verdict, [name for name, one in comparison.channels.items() if one.verdict == "differ"]
    ('differ', ['slider_x'])
    """
    rules = load_mapping(Path(mapping)) if isinstance(mapping, str | Path) else mapping
    first, second = ([("base", as_source(table, label))] for table, label in zip((a, b), labels, strict=True))
    return compare_files(
        first,
        second,
        labels=(labels[0], labels[1]),
        scene=scene,
        mapping=rules,
        tolerance=tolerance,
        share=share,
        **options,
    )
