"""Many states of a combustor at once."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from vrsopt.bulk import BulkSolver, ManySolutions
from vrsopt.combustor.data import ReactorData
from vrsopt.combustor.network import combustor
from vrsopt.combustor.start import network_start
from vrsopt.combustor.zones import fuel_stream

CHUNK = 20  # points per compiled call: a network is large
ANCHORS = 80  # points that are started reactor by reactor; the others from a polynomial through these


def solve_combustor_many(
    parameters: np.ndarray, reactors: ReactorData, hydrogen_to_carbon: float, heating_value: float
) -> ManySolutions:
    """Solve the combustor at every row of ``parameters`` (N, 5).

    Columns in the order of :func:`vrsopt.combustor.network.combustor`, SI units. Raises :class:`InputError` for a wrong
    shape or a value that is not finite.
    """
    return _bulk_solver(reactors.model_dump_json(), hydrogen_to_carbon, heating_value).solve(parameters)


@lru_cache(maxsize=8)
def _bulk_solver(text: str, hydrogen_to_carbon: float, heating_value: float) -> BulkSolver:
    reactors = ReactorData.model_validate_json(text)
    system, fuel = (
        combustor(reactors, hydrogen_to_carbon, heating_value),
        fuel_stream(hydrogen_to_carbon, heating_value),
    )
    scale = np.array([unknown.scale for unknown in system.unknowns])

    def start(points: np.ndarray) -> np.ndarray:
        return network_start(reactors, fuel, points) / scale

    return BulkSolver(system, (start,), chunk=CHUNK)
