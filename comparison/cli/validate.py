"""``sixbar validate``: run two models, or more in pairs, on scenes, compare them, write the report."""

from comparison.cli import options
from comparison.cli.console import print_json


def validate(
    scenes: options.SceneNames = None,
    out: options.OutFolder = None,
    jobs: options.Jobs = None,
    accuracy: options.Accuracy = None,
    models: options.Models = "reference,exudyn",
    overrides: options.Overrides = None,
    allow_indeterminate: options.AllowIndeterminate = False,
    quick: options.Quick = False,
    verbose: options.Verbose = False,
    quiet: options.Quiet = False,
    json: options.AsJson = False,
) -> int:
    """Run scenes by two models, compare them, and write a report.

    SCENE: shipped names or TOML files; all shipped scenes by default. Each model runs with refined and
    perturbed runs, which give its uncertainty. With more than two models each pair is compared, and the
    report identifies the outlier among them. Stopped by Ctrl-C, it writes the report of the scenes finished
    by then, marked as incomplete.
    """
    from comparison.accuracy.levels import TIERS
    from comparison.cli.validation import Request, validate_pair, validate_pairs
    from comparison.execution.pool import cpus, kept_workers
    from comparison.models import named
    from comparison.scene import name_with, parse_set

    changes, tiers = parse_set(overrides or []), TIERS[:1] if quick else TIERS
    request = Request(
        scenes or [], changes, accuracy, tiers, jobs or cpus(), allow_indeterminate, verbose, quiet, json
    )
    with kept_workers():
        first, second, *others = several = named(models)
        if others:
            folder = out or options.REPORTS / name_with("pairwise", changes)
            code, summary = validate_pairs(request, several, folder)
        else:
            code, summary = validate_pair(request, (first, second), out)
    if json and summary:
        print_json(summary)
    return code
