"""Command line `sixbar`: one module per command."""

import sys

from comparison.garbage import collect_rarely

collect_rarely()  # importing makes most objects
try:
    from comparison.cli.main import main
except KeyboardInterrupt:  # importing takes long enough for a Ctrl-C
    print("sixbar: interrupted", file=sys.stderr)  # noqa: T201
    sys.exit(130)

__all__ = ["main"]
