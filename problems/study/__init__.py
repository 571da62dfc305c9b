"""Reproduction of the reference study: one module per figure or table, ``python -m problems.study`` runs them.

The other studies in ``problems/`` run as scripts and import each other by plain name, so their folder goes on the path.
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1]))
