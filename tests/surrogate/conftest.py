"""Makes ``analytic_rotor`` importable by name, here and in the worker processes that take over the import path."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
