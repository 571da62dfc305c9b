"""The rotor marched in time until its motion repeats, and trimmed by Newton's method with differences. Plain numpy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import hypot, pi, radians

import numpy as np
from marched_rotor import MarchedRotor, Work

SCALES = (0.3, 0.05, 0.05, 0.1, 0.02, 0.03)  # m and rad, of flap, lag and torsion modes
INFLOW_SCALE = 0.02


@dataclass(frozen=True)
class Trim:
    """Controls (collective, lateral, longitudinal) [rad], mean loads and what was spent."""

    controls: np.ndarray
    thrust: float
    moments: tuple[float, float]
    power: float
    miss: float
    work: Work


class MarchedTrim(MarchedRotor):
    """A rotor that is marched and trimmed."""

    def first_controls(self) -> np.ndarray:
        """Of a rigid blade in momentum theory, its flapping cancelled by the cyclic pitch."""
        c, data = self.condition, self.data
        tip_speed, solidity = c.rotor_speed * data["radius"], data["blades"] * data["chord"] / (pi * data["radius"])
        loading = c.targets[0] / (c.density * pi * data["radius"] ** 2 * tip_speed**2)
        inflow = self.hover_inflow()
        for _ in range(50):
            inflow = 0.5 * inflow + 0.25 * loading / hypot(self.advance, inflow - self.upward)
        pitch = 3 * (2 * loading / (solidity * 2 * pi) + (inflow - self.upward) / 2) / (1 + 1.5 * self.advance**2)
        return np.array([pitch, 0.0, -2 * self.advance * pitch])

    def revolve(self, state: np.ndarray, controls: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """One revolution by Runge-Kutta's method: the state after it and the mean hub loads (6,)."""
        steps, mean, tau = self.numerics.steps, np.zeros(6), np.zeros(self.inflow.size)

        def slope(azimuth: float, fraction: float, state: np.ndarray) -> np.ndarray:
            nonlocal mean, tau
            self.slopes.fraction = fraction
            change, hub, own = self.derivative(azimuth + fraction * 2 * pi / steps, state, controls)
            if fraction == 0.0:
                mean, tau = mean + hub / steps, tau + own / steps
            return change

        for k in range(steps):
            state = runge_kutta(partial(slope, 2 * pi * k / steps), state, self.step)
        if not self.numerics.passage:
            wake = slice(self.splits[1], self.splits[2])
            # a larger share excites the torsion, which a static section does not damp
            for _ in range(steps // (4 if self.numerics.dynamic_stall else 12)):
                state[wake] = runge_kutta(lambda _, x: self.wake_rate(x, tau), state[wake], self.step)
        self.work.revolutions += 1
        return state, mean

    def march(self, state: np.ndarray, controls: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Revolutions until the motion repeats: the state and the mean hub loads of the last one."""
        self.work.marches += 1
        scale = np.concatenate([np.tile(SCALES, self.shape[0]), np.full(self.inflow.size, INFLOW_SCALE)])
        motion = np.r_[: self.splits[0], self.splits[1] : self.splits[2]]
        loads = np.zeros(6)
        for _ in range(self.numerics.most_revolutions):
            before = state[motion]
            state, loads = self.revolve(state, controls)
            if np.max(np.abs(state[motion] - before) / scale) < self.numerics.periodic:
                break
        return state, loads

    def miss(self, loads: np.ndarray) -> np.ndarray:
        """Thrust and hub moments against their targets, over typical sizes (3,)."""
        thrust, *moments = self.condition.targets
        wrong = np.array([loads[2] - thrust, loads[3] - moments[0], loads[4] - moments[1]])
        return wrong / (thrust * np.array([1.0, 0.01 * self.data["radius"], 0.01 * self.data["radius"]]))

    def trim(self, controls: np.ndarray, difference: float = radians(0.25), most: int = 12) -> Trim:
        """Newton's method on the controls; the Jacobian is kept while the miss falls to a third in a step."""
        state, loads = self.march(self.start(), controls)
        miss, jacobian = self.miss(loads), None
        for _ in range(most):
            if np.max(np.abs(miss)) < self.numerics.trimmed:
                break
            if jacobian is None:
                moved = [self.march(state, controls + row) for row in difference * np.eye(3)]
                jacobian = np.array([(self.miss(other) - miss) / difference for _, other in moved]).T
            controls = controls - np.linalg.solve(jacobian, miss)
            before = np.max(np.abs(miss))
            state, loads = self.march(state, controls)
            miss = self.miss(loads)
            if np.max(np.abs(miss)) > before / 3:
                jacobian = None
        return Trim(
            controls=controls,
            thrust=float(loads[2]),
            moments=(float(loads[3]), float(loads[4])),
            power=float(-loads[5] * self.condition.rotor_speed),
            miss=float(np.max(np.abs(miss))),
            work=self.work,
        )


def runge_kutta(slope: Callable[[float, np.ndarray], np.ndarray], x: np.ndarray, step: float) -> np.ndarray:
    """One step of fourth order; ``slope(fraction of the step, x)``."""
    k1 = slope(0.0, x)
    k2 = slope(0.5, x + step / 2 * k1)
    k3 = slope(0.5, x + step / 2 * k2)
    k4 = slope(1.0, x + step * k3)
    return x + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
