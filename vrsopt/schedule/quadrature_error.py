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
        step = self.of.mesh.step
        fuel = FUEL_SCALE * x[self.of.layout.fuel]
        mass, *others = self.inputs(x, unburned)
        for _ in range(3):
            flow = self.model.evaluate(mass, *others).fuel_flow.reshape(len(step), -1)
            burned = fuel[:, :1] + step[:, None] * (flow @ self.integral)
            mass = (unburned[:, None] - burned).ravel()
        return np.asarray(fuel[:, -1] - fuel[:, 0] - step * (flow @ self.weights))

    def inputs(self, x: np.ndarray, unburned: np.ndarray) -> list[np.ndarray]:
        """Mass [kg], rotor speed [rad/s], twist [rad] and charged rate [rad/s2] at all points, each (3 N,)."""
        layout = self.of.layout
        burned = FUEL_SCALE * x[layout.fuel] @ lagrange(layout.shares, self.shares)
        speed, twist = (
            (x[c.start][:, None] * (1.0 - self.shares) + x[c.end][:, None] * self.shares) * c.scale
            for c in layout.controls
        )
        rate = np.repeat(x[layout.charged_rate] * layout.controls[0].rate_scale, len(self.shares))
        return [(unburned[:, None] - burned).ravel(), speed.ravel(), twist.ravel(), rate]


def lagrange(nodes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Values (n, m) at ``at`` (m,) of the polynomials that are one at one of the ``nodes`` (n,) and zero at others."""
    others = [np.delete(nodes, k) for k in range(len(nodes))]
    return np.array(
        [np.prod([(at - o) / (node - o) for o in rest], axis=0) for node, rest in zip(nodes, others, strict=True)]
    )
