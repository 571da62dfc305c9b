"""The linear maps of the whole-mission problem around its node function."""

from __future__ import annotations

import numpy as np

from vrsopt.schedule.nlp import Maps
from vrsopt.schedule.rows import Discretisation, Rows
from vrsopt.schedule.transcription import input_map, quadrature


def make_maps(
    of: Discretisation, rows: Rows, *, mass_changes: np.ndarray, regularisation: float, cost: int | None
) -> Maps:
    """Inputs, rows and objective: the fuel burned at the end, or the integral of the output number ``cost``.

    ``mass_changes`` [kg] at the start of each segment; ``regularisation`` weighs the mean square of the scaled rates.
    """
    layout, e, mesh = of.layout, of.evaluations, of.mesh
    objective, integrand, penalty = np.zeros(layout.size), np.zeros(e.outputs), np.zeros(layout.size)
    if cost is None:
        objective[layout.fuel[-1, -1]] = 1.0
    else:
        integrand = quadrature(mesh, of.method, e, cost, np.ones(len(mesh), dtype=bool))
    for control in layout.controls:
        penalty[control.rate] = regularisation * mesh.step / mesh.step.sum()
    if layout.charged is not None:  # it costs nothing where the engines idle or the rotor has no inertia
        penalty[layout.charged] = penalty[layout.controls[0].rate]
    takeoff, constant = np.zeros(e.inputs), np.zeros(e.inputs)
    takeoff[e.state_row] = 1.0
    constant[e.state_row] = np.cumsum(mass_changes)[mesh.segment[e.interval]]
    return Maps(input_map(layout, e), takeoff, constant, rows.linear, rows.weights, objective, integrand, penalty)
