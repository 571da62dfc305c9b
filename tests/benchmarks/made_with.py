"""What a benchmark ran with, beside its numbers, so that those of another model are told apart."""

from __future__ import annotations

import sys
from importlib.metadata import version

import vrsopt
from vrsopt.helicopter import MODEL_VERSION, helicopter


def made_with(*packages: str) -> dict[str, str]:
    """Versions of Python, this package, its model and data, CasADi, numpy and ``packages``."""
    return {
        "python": sys.version.split()[0],
        "vrsopt": vrsopt.__version__,
        "model": MODEL_VERSION,
        "data": helicopter().data_hash,
        **{name: version(name) for name in ("casadi", "numpy", *packages)},
    }
