"""Finite-element blade of the time-marching baseline: modes, and the integrals of its non-linear inertia.

Plain numpy. A blade point of the reference radius r stands at (r - s, v, h) in axes that turn with the shaft (outward,
along the motion, up): flap w and lag v, h = w + precone r, and the shortening s, the integral of (h'^2 + v'^2) / 2. The
equations of motion are those of d'Alembert with this position, to second order in the deflections.
"""

from __future__ import annotations

from math import radians

import numpy as np
from scipy.linalg import eigh

ELEMENTS = 24
GAUSS = 4


class Beam:
    """Cubic beam elements for bending and twisting (angle and its slope at the nodes), clamped at the first station."""

    def __init__(self, data: dict) -> None:
        self.data = data
        station = np.array(data["station"])
        pieces = [
            np.linspace(a, b, max(1, round(ELEMENTS * (b - a) / np.ptp(station))) + 1) for a, b in _pairs(station)
        ]
        self.nodes = np.unique(np.concatenate(pieces))
        x, weights = np.polynomial.legendre.leggauss(GAUSS)
        length = np.diff(self.nodes)
        self.radius = (self.nodes[:-1, None] + length[:, None] * (1 + x) / 2).ravel()
        self.weight = (length[:, None] * weights / 2).ravel()

    def property(self, name: str) -> np.ndarray:
        """A quantity per length at the Gauss points (G,)."""
        return np.interp(self.radius, self.data["station"], self.data[name])

    def shapes(self, radius: np.ndarray, order: int) -> np.ndarray:
        """The order-th derivative of every nodal shape function at radii (E,): (E, 2 nodes)."""
        table = np.zeros((len(radius), 2 * len(self.nodes)))
        element = np.clip(np.searchsorted(self.nodes, radius) - 1, 0, len(self.nodes) - 2)
        for row, (r, e) in enumerate(zip(radius, element, strict=True)):
            a, b = self.nodes[e], self.nodes[e + 1]
            # the cubic with unit value or slope at one end: solved, not quoted
            ends = np.array([[1, a, a**2, a**3], [0, 1, 2 * a, 3 * a**2], [1, b, b**2, b**3], [0, 1, 2 * b, 3 * b**2]])
            power = {0: [1, r, r**2, r**3], 1: [0, 1, 2 * r, 3 * r**2], 2: [0, 0, 2, 6 * r]}[order]
            table[row, 2 * e : 2 * e + 4] = np.array(power, dtype=float) @ np.linalg.inv(ends)
        return table

    def integral(self, order: int, density: np.ndarray) -> np.ndarray:
        """Matrix of the integral of density times the product of two shape functions' derivatives."""
        table = self.shapes(self.radius, order)
        return table.T @ ((density * self.weight)[:, None] * table)

    def outboard(self, values: np.ndarray) -> np.ndarray:
        """Integral of values (G, ...) from each Gauss point to the tip."""
        return self.total(values) - self.inboard(values)

    def total(self, values: np.ndarray) -> np.ndarray:
        """Integral over the blade of values (G, ...)."""
        return np.tensordot(self.weight, values, 1)

    def inboard(self, values: np.ndarray) -> np.ndarray:
        """Integral of values (G, ...) from the root to each Gauss point, through the polynomial of each element."""
        x = np.polynomial.legendre.leggauss(GAUSS)[0]
        power = np.arange(GAUSS)
        inner = (x[:, None] ** (power + 1) - (-1.0) ** (power + 1)) / (power + 1) @ np.linalg.inv(x[:, None] ** power)
        parts = values.reshape(-1, GAUSS, *values.shape[1:])
        half = np.diff(self.nodes) / 2
        inside = np.einsum("e,gk,ek...->eg...", half, inner, parts)
        whole = np.einsum("eg,eg...->e...", self.weight.reshape(-1, GAUSS), parts)
        before = np.cumsum(whole, axis=0) - whole
        return (inside + before[:, None]).reshape(values.shape)


class ModalBlade:
    """A blade in few modes: n_w flap, n_v lag and n_p torsion coordinates, uncoupled modes at nominal rotor speed."""

    def __init__(self, rotor: dict, counts: tuple[int, int, int] = (3, 2, 1)) -> None:
        data = rotor["blade"]
        if data["mass_centre_offset"] or data["aerodynamic_centre_offset"]:
            raise ValueError("chordwise offsets of the blade: must be 0, the march has no terms for them")
        self.beam, self.counts = Beam(data), counts
        self.precone, self.radius = radians(rotor["precone"]), rotor["radius"]
        beam, speed = self.beam, rotor["nominal_rotor_speed"]
        self.density = beam.property("mass_per_length")
        tension = beam.integral(1, beam.outboard(self.density * beam.radius))
        mass = beam.integral(0, self.density)
        self.polar = beam.property("polar_inertia")
        polar = beam.integral(0, self.polar)
        flap, lag, twisting = (
            beam.integral(order, beam.property(name))
            for order, name in ((2, "bending_stiffness_flap"), (2, "bending_stiffness_lag"), (1, "torsional_stiffness"))
        )
        bases = [
            self._modes(flap + speed**2 * tension, mass, counts[0], held=2),
            self._modes(lag + speed**2 * (tension - mass), mass, counts[1], held=2),
            self._modes(twisting + speed**2 * polar, polar, counts[2], held=1),
        ]
        self.flap, self.lag, self.torsion = (vectors for _, vectors in bases)
        self.frequencies = np.concatenate([frequency for frequency, _ in bases])
        self.mass = np.concatenate([np.diag(v.T @ m @ v) for (_, v), m in zip(bases, (mass, mass, polar), strict=True)])
        share = np.repeat(
            [data["structural_damping"], data["structural_damping_lag"], data["structural_damping"]], counts
        )
        self.damping = 2 * share * self.frequencies * self.mass
        self.twisting = self.torsion.T @ twisting @ self.torsion
        self._tables()

    def _modes(self, stiffness: np.ndarray, mass: np.ndarray, count: int, held: int) -> tuple[np.ndarray, np.ndarray]:
        squares, vectors = eigh(stiffness[held:, held:], mass[held:, held:])
        shapes = np.vstack([np.zeros((held, count)), vectors[:, :count] / vectors[-2, :count]])
        return np.sqrt(squares[:count]), shapes

    def _tables(self) -> None:
        beam, r = self.beam, self.beam.radius
        self.up, self.along = beam.shapes(r, 0) @ self.flap, beam.shapes(r, 0) @ self.lag  # (G, n_w), (G, n_v)
        self.angle = beam.shapes(r, 0) @ self.torsion
        self.up_curvature, self.along_curvature = beam.shapes(r, 2) @ self.flap, beam.shapes(r, 2) @ self.lag
        n_w, n_v, _ = self.counts
        slope = np.zeros((len(r), n_w + n_v, n_w + n_v))
        w_r, v_r = beam.shapes(r, 1) @ self.flap, beam.shapes(r, 1) @ self.lag
        slope[:, :n_w, :n_w] = w_r[:, :, None] * w_r[:, None, :]
        slope[:, n_w:, n_w:] = v_r[:, :, None] * v_r[:, None, :]
        self.shortening = beam.inboard(slope)  # (G, n, n): derivative of s by two coordinates
        self.coned = np.hstack([self.precone * self.up, np.zeros_like(self.along)])  # derivative at rest
        self.stiffness = beam.property("bending_stiffness_flap"), beam.property("bending_stiffness_lag")

    def at(self, radius: np.ndarray) -> tuple[np.ndarray, ...]:
        """Flap, flap slope, lag, lag slope and torsion modes at radii (E,): (n, E) each."""
        value, slope = self.beam.shapes(radius, 0), self.beam.shapes(radius, 1)
        pairs = ((value, self.flap), (slope, self.flap), (value, self.lag), (slope, self.lag), (value, self.torsion))
        return tuple((table @ basis).T for table, basis in pairs)

    def accelerations(
        self,
        q: np.ndarray,
        rate: np.ndarray,
        load: np.ndarray,
        *,
        pitch: np.ndarray,
        twist: float,
        rotor_speed: float,
        specific_force: np.ndarray,
    ) -> np.ndarray:
        """Modal accelerations (B, n) from coordinates, rates and generalised aerodynamic loads (B, n).

        pitch (B, 2): that of the root and its second time derivative. specific_force (B, 3): acceleration less gravity
        of the hub, outward, along the motion and up. The hub does not turn.
        """
        forces = load - self.damping * rate
        n = self.counts[0] + self.counts[1]
        forces[:, :n] -= self._inertia(q[:, :n], rate[:, :n], rotor_speed, specific_force)
        forces -= self._elastic(q, pitch, twist, rotor_speed)
        return forces / self.mass

    def _inertia(self, q: np.ndarray, rate: np.ndarray, speed: float, force: np.ndarray) -> np.ndarray:
        """Generalised inertial loads of bending (B, n) without the modal acceleration itself."""
        n_w, r = self.counts[0], self.beam.radius
        shortening = self.coned + np.einsum("gij,bj->bgi", self.shortening, q)  # of s by each coordinate
        x_rate = -np.einsum("bgi,bi->bg", shortening, rate)
        v, v_rate = q[:, n_w:] @ self.along.T, rate[:, n_w:] @ self.along.T
        f_r, f_t, f_z = force.T[:, :, None]
        # second order in the deflections
        outward = -(speed**2) * r - 2 * speed * v_rate + f_r
        along = -(speed**2) * v + 2 * speed * x_rate + f_t
        element = self.density * self.beam.weight
        loads = -np.einsum("bgi,bg->bi", shortening, outward * element)
        loads[:, :n_w] += (f_z * element) @ self.up
        loads[:, n_w:] += (along * element) @ self.along
        return loads

    def _elastic(self, q: np.ndarray, pitch: np.ndarray, twist: float, speed: float) -> np.ndarray:
        """Generalised loads (B, n) of bending about the pitched axes of the section, of twisting and of the polar
        inertia (propeller moment)."""
        n_w, n = self.counts[0], self.counts[0] + self.counts[1]
        p = q[:, n:] @ self.angle.T
        theta = pitch[:, :1] - twist * (self.beam.radius / self.radius - 0.75) + p
        sin, cos = np.sin(theta), np.cos(theta)
        w_rr, v_rr = q[:, :n_w] @ self.up_curvature.T, q[:, n_w:n] @ self.along_curvature.T
        flatwise, edgewise = w_rr * cos - v_rr * sin, v_rr * cos + w_rr * sin
        weight = self.beam.weight
        moment_flat, moment_edge = self.stiffness[0] * flatwise * weight, self.stiffness[1] * edgewise * weight
        twisting = moment_edge * flatwise - moment_flat * edgewise
        twisting += self.polar * weight * (pitch[:, 1:] + speed**2 * sin * cos)
        return np.hstack(
            [
                (moment_flat * cos + moment_edge * sin) @ self.up_curvature,
                (moment_edge * cos - moment_flat * sin) @ self.along_curvature,
                twisting @ self.angle + q[:, n:] @ self.twisting,
            ]
        )


def _pairs(values: np.ndarray) -> zip:
    return zip(values[:-1], values[1:], strict=True)
