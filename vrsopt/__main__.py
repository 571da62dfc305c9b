"""``python -m vrsopt``: the command line."""

import sys

from vrsopt.cli import main

if __name__ == "__main__":
    sys.exit(main())
