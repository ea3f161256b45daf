"""``python -m comparison`` is ``sixbar``."""

import sys

from comparison.cli import main

if __name__ == "__main__":
    sys.exit(main())
