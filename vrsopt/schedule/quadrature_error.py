"""How good the quadrature of a trajectory is: its fuel in each interval against a formula of higher order."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vrsopt.schedule.layout import FUEL_SCALE
from vrsopt.schedule.path_model import PathModelFactory
from vrsopt.schedule.rows import Discretisation

if TYPE_CHECKING:
    from vrsopt.mission.profile import Profile

GAUSS = np.polynomial.legendre.leggauss(3)  # order 6


class FinerQuadrature:
    """The aircraft at the points of a Gauss formula in every interval, built once."""

    def __init__(self, profile: Profile, make_path_model: PathModelFactory, of: Discretisation) -> None:
        self.of, mesh = of, of.mesh
        self.shares, self.weights = 0.5 * (GAUSS[0] + 1.0), 0.5 * GAUSS[1]
        powers = np.arange(len(self.shares))
        to_power = self.shares[:, None] ** (powers + 1) / (powers + 1)  # integrals of the powers up to each share
        self.integral = np.linalg.solve(self.shares[:, None] ** powers, np.eye(len(powers))).T @ to_power.T
        time = mesh.start[:, None] + self.shares * mesh.step[:, None]
        segment = np.repeat(mesh.segment, len(self.shares))
        self.model = make_path_model(profile.conditions(segment, time.ravel()))

    def error(self, x: np.ndarray, unburned: np.ndarray) -> np.ndarray:
        """Fuel of each interval minus that of the Gauss formula (N,) [kg], along the same rotor speed and twist.

        ``unburned`` (N,) [kg] is the mass but for the fuel burned. That is first interpolated between its unknowns and
        then integrated from the flow found so, twice: interpolated alone it would know no more than the collocation.
        """
        layout, mesh = self.of.layout, self.of.mesh
        speed, twist = (
            (x[c.start][:, None] * (1.0 - self.shares) + x[c.end][:, None] * self.shares) * c.scale
            for c in layout.controls
        )
        rate = np.repeat(x[layout.charged_rate] * layout.controls[0].rate_scale, len(self.shares))
        fuel = FUEL_SCALE * x[layout.fuel]
        burned = fuel @ _lagrange(layout.shares, self.shares)
        for _ in range(3):
            mass = (unburned[:, None] - burned).ravel()
            flow = self.model.evaluate(mass, speed.ravel(), twist.ravel(), rate).fuel_flow.reshape(burned.shape)
            burned = fuel[:, :1] + mesh.step[:, None] * (flow @ self.integral)
        return np.asarray(fuel[:, -1] - fuel[:, 0] - mesh.step * (flow @ self.weights))


def _lagrange(nodes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Values (n, m) at ``at`` (m,) of the polynomials that are one at one of the ``nodes`` (n,) and zero at others."""
    others = [np.delete(nodes, k) for k in range(len(nodes))]
    return np.array(
        [np.prod([(at - o) / (node - o) for o in rest], axis=0) for node, rest in zip(nodes, others, strict=True)]
    )
