"""Many operating points of an engine at once."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from vrsopt.bulk import BulkSolver, ManySolutions
from vrsopt.turboshaft.cycle import Mode, gas_path
from vrsopt.turboshaft.data import EngineData, load_engine


def solve_many(parameters: np.ndarray, *, mode: Mode = "power", engine_data: EngineData | None = None) -> ManySolutions:
    """Solve the gas path of an engine at every row of ``parameters`` (N, 8), about 0.1 ms each.

    Columns in the order of :func:`vrsopt.turboshaft.cycle.gas_path`, SI units. A point that Newton misses is tried once
    more by IPOPT. Raises :class:`InputError` for a wrong shape or a value that is not finite.
    """
    data = engine_data if engine_data is not None else load_engine()
    return _bulk_solver(data.model_dump_json(), mode).solve(parameters)


@lru_cache(maxsize=8)
def _bulk_solver(text: str, mode: Mode) -> BulkSolver:
    return BulkSolver(gas_path(EngineData.model_validate_json(text), mode))
