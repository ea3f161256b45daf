"""Command line `sixbar`: a module for each command, or for several of one kind."""

import sys

try:
    from comparison.cli.main import main
except KeyboardInterrupt:  # importing takes long enough for a Ctrl-C
    print("sixbar: interrupted", file=sys.stderr)  # noqa: T201
    sys.exit(130)

__all__ = ["main"]
