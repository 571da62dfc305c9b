"""Main rotor of the time-marching baseline: the derivative of its state, and its loads on the hub. Plain numpy.

Hub axes aft, right, up; azimuth from aft, counter-clockwise. Every blade has its own modal states and, with dynamic
stall, its own section states; the inflow is dynamic. The hub does not turn.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import atan2, hypot, pi, radians, sqrt

import numpy as np
from marched_air import LAGS, PetersHe, Section
from marched_blade import ModalBlade


@dataclass(frozen=True)
class Condition:
    """A rotor in a wind tunnel: wind and specific force (acceleration less gravity) at the hub, aft, right, up, m/s and
    m/s2; twist [rad], washout positive; the thrust [N] and the hub moments about the aft and right axes [N m] to
    reach."""

    wind: tuple[float, float, float]
    specific_force: tuple[float, float, float]
    rotor_speed: float
    twist: float
    density: float
    speed_of_sound: float
    induced_power_factor: float
    section_drag_level: float
    targets: tuple[float, float, float]


@dataclass(frozen=True)
class Numerics:
    """How to march.

    passage: the inflow changes all the time, with blade-passage frequency too; else it is held over a revolution and
    then marched over a share of one with the mean loads. harmonic, shape: highest ones of the inflow. periodic: the
    largest change in one revolution, over typical motions, of a motion that counts as repeated. trimmed: largest miss
    of a trim, over the thrust and over the thrust times 1 % of the radius.
    """

    steps: int = 72
    stations: int = 12
    harmonic: int = 3
    shape: int = 5
    passage: bool = False
    dynamic_stall: bool = False
    periodic: float = 3e-4
    trimmed: float = 1e-3
    most_revolutions: int = 60


@dataclass
class Work:
    """What a computation took."""

    sections: int = 0  # evaluations of one station at one azimuth
    revolutions: int = 0
    marches: int = 0


@dataclass
class Slopes:
    """Time derivatives of quantities known at the start of every step: backward differences of second order,
    extrapolated linearly inside the step."""

    step: float
    fraction: float = 0.0
    past: dict[str, list[np.ndarray]] = field(default_factory=dict)
    rates: dict[str, list[np.ndarray]] = field(default_factory=dict)

    def __call__(self, name: str, value: np.ndarray) -> np.ndarray:
        past, rates = self.past.setdefault(name, []), self.rates.setdefault(name, [])
        if self.fraction == 0.0:
            past.append(value)
            del past[:-3]
            known = len(past) == 3
            rates.append((3 * past[2] - 4 * past[1] + past[0]) / (2 * self.step) if known else 0 * value)
            del rates[:-2]
        return rates[-1] + self.fraction * (rates[-1] - rates[0])


class MarchedRotor:
    """The rotor of a data file (the tables of numbers, without units) at one condition."""

    def __init__(self, data: dict, condition: Condition, numerics: Numerics) -> None:
        self.data, self.condition, self.numerics, self.work = data, condition, numerics, Work()
        self.blade, self.section = ModalBlade(data), Section(data["section"])
        points, weights = np.polynomial.legendre.leggauss(numerics.stations)
        inner, outer = data["root_cutout"] * data["radius"], data["radius"]
        self.radius, self.weight = inner + (points + 1) / 2 * (outer - inner), weights / 2 * (outer - inner)
        self.shapes = self.blade.at(self.radius)
        self.inflow = PetersHe(self.radius / outer, self.weight / outer, numerics.harmonic, numerics.shape)
        self.spacing = 2 * pi * np.arange(data["blades"]) / data["blades"]
        tip_speed = condition.rotor_speed * outer
        self.advance, self.upward = hypot(*condition.wind[:2]) / tip_speed, condition.wind[2] / tip_speed
        self.downwind = atan2(condition.wind[1], condition.wind[0]) if self.advance > 1e-9 else 0.0
        modes, blades = len(self.blade.mass), data["blades"]
        self.splits = np.cumsum([blades * modes, blades * modes, self.inflow.size])
        self.shape = (blades, modes)
        self.step = 2 * pi / condition.rotor_speed / numerics.steps
        self.slopes = Slopes(self.step)

    def start(self) -> np.ndarray:
        """Blades at rest, the inflow of momentum theory in hover, attached flow."""
        lags = np.zeros((LAGS, len(self.spacing), len(self.radius))) if self.numerics.dynamic_stall else np.zeros(0)
        lags[3:4] = 1.0
        wake = np.zeros(self.inflow.size)
        wake[0] = self.hover_inflow() / sqrt(3)
        return np.concatenate([np.zeros(2 * self.shape[0] * self.shape[1]), wake, lags.ravel()])

    def hover_inflow(self) -> float:
        area, tip_speed = pi * self.data["radius"] ** 2, self.condition.rotor_speed * self.data["radius"]
        return sqrt(self.condition.targets[0] / (2 * self.condition.density * area)) / tip_speed

    def derivative(
        self, azimuth: float, state: np.ndarray, controls: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Time derivative of the state, loads on the hub (force and moment, aft, right, up) and tau of the loads."""
        q, rate, wake, lags = np.split(state, self.splits)
        q, rate = q.reshape(self.shape), rate.reshape(self.shape)
        psi, speed, R = azimuth + self.spacing, self.condition.rotor_speed, self.data["radius"]
        cos, sin = np.cos(psi)[:, None], np.sin(psi)[:, None]
        waves = self.inflow.waves(psi - self.downwind)
        induced = self.condition.induced_power_factor * speed * R * self.inflow.induced(wake, waves)
        place = self._place(q)
        loads, lag_rates = self._sections(q, rate, (cos, sin), place, induced, controls, lags)
        outward, along, up, moment = loads

        _, lateral, longitudinal = controls
        swing = lateral * cos + longitudinal * sin
        weighted = np.array([up, along, moment]) * self.weight
        flap, _, lag, _, torsion = self.shapes
        acceleration = self.blade.accelerations(
            q,
            rate,
            np.hstack([weighted[0] @ flap.T, weighted[1] @ lag.T, weighted[2] @ torsion.T]),
            pitch=np.hstack([controls[0] + swing, -(speed**2) * swing]),
            twist=self.condition.twist,
            rotor_speed=speed,
            specific_force=_turned(np.array(self.condition.specific_force), cos, sin),
        )
        tau = self.inflow.loads(up / (self.condition.density * speed**2 * R**3), waves)
        wake_rate = self.wake_rate(wake, tau) if self.numerics.passage else 0 * wake
        change = np.concatenate([rate.ravel(), acceleration.ravel(), wake_rate, lag_rates.ravel()])
        return change, self._hub(loads, place, (cos, sin)), tau

    def wake_rate(self, wake: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """Time derivative of the inflow states."""
        return self.condition.rotor_speed * self.inflow.rate(wake, tau, self.advance, self.upward)

    def _place(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Place (3, B, E) of the quarter chord and the blade's own axes (3, 3, B, E): along the span, forward, up; both
        in axes that turn with the shaft: outward, along the motion, up."""
        n_w, n_v, _ = self.blade.counts
        flap, flap_slope, lag, lag_slope, _ = self.shapes
        w, v, precone = q[:, :n_w], q[:, n_w : n_w + n_v], radians(self.data["precone"])
        height, lead = w @ flap + precone * self.radius, v @ lag
        rise, turn = np.arctan(w @ flap_slope + precone), np.arctan(v @ lag_slope)
        cos_r, sin_r, cos_t, sin_t = np.cos(rise), np.sin(rise), np.cos(turn), np.sin(turn)
        axes = np.array(
            [
                [cos_r * cos_t, cos_r * sin_t, sin_r],
                [-sin_t, cos_t, 0 * sin_t],
                [-sin_r * cos_t, -sin_r * sin_t, cos_r],
            ]
        )
        return np.array([np.broadcast_to(self.radius, lead.shape), lead, height]), axes

    def _sections(
        self,
        q: np.ndarray,
        rate: np.ndarray,
        direction: tuple[np.ndarray, np.ndarray],
        place: tuple[np.ndarray, np.ndarray],
        induced: np.ndarray,
        controls: np.ndarray,
        lags: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Loads per length along the blade's own axes and nose-up moment (4, B, E), and rates of the section states."""
        (cos, sin), c, chord = direction, self.condition, self.data["chord"]
        n_w, n_v, _ = self.blade.counts
        flap, _, lag, _, torsion = self.shapes
        (radius, lead, _), axes = place
        aft, right, up = c.wind
        wind = np.array(  # relative to the element
            [
                aft * cos + right * sin + c.rotor_speed * lead,
                right * cos - aft * sin - c.rotor_speed * radius - rate[:, n_w : n_w + n_v] @ lag,
                up - induced - rate[:, :n_w] @ flap,
            ]
        )
        outward, forward, upward = np.sum(axes * wind, axis=1)
        pitch = controls[0] + controls[1] * cos + controls[2] * sin + q[:, n_w + n_v :] @ torsion
        pitch = pitch - c.twist * (self.radius / self.data["radius"] - 0.75)

        U = np.sqrt(forward**2 + upward**2 + 4.0)  # 2 m/s keep the edge of the reversed flow regular
        sine = (upward * np.cos(pitch) - forward * np.sin(pitch)) / U
        cosine = -(forward * np.cos(pitch) + upward * np.sin(pitch)) / U
        self.work.sections += U.size
        level, mach, rates = c.section_drag_level, U / c.speed_of_sound, lags
        if self.numerics.dynamic_stall:
            turning = c.rotor_speed * (controls[2] * cos - controls[1] * sin + axes[0, 2])  # pitch, and coned blade
            (lift, drag, moment), rates = self.section.unsteady(
                lags.reshape(LAGS, *U.shape),
                speed=U,
                angle=(sine, cosine),
                mach=mach,
                pitch_rate=turning + rate[:, n_w + n_v :] @ torsion,
                chord=chord,
                level=level,
                slopes=self.slopes,
            )
        else:
            lift, drag, moment = self.section.static(sine, cosine, mach, level)
        loads = np.array(
            [drag * outward, drag * forward + lift * upward, drag * upward - lift * forward, moment * chord * U]
        )
        return 0.5 * c.density * chord * U * loads, rates

    def _hub(
        self,
        loads: np.ndarray,
        place: tuple[np.ndarray, np.ndarray],
        direction: tuple[np.ndarray, np.ndarray],
    ) -> np.ndarray:
        """Force and moment (6,) on the hub of the air's loads on all blades where they stand.

        The inertial loads of a motion that repeats have no mean.
        """
        arm, axes = place
        force = np.sum(axes * loads[:3, None], axis=0)
        moment = np.cross(arm, force, axis=0) + axes[0] * loads[3]
        totals = np.concatenate([force, moment]) @ self.weight  # (6, B), turning with the shaft
        cos, sin = direction
        return np.concatenate([_turned(totals[k : k + 3].T, cos, -sin).sum(axis=0) for k in (0, 3)])


def _turned(vectors: np.ndarray, cos: np.ndarray, sin: np.ndarray) -> np.ndarray:
    """Vectors (3,) or (B, 3) in axes turned by the angles (B, 1) about up."""
    x, y, z = np.broadcast_to(vectors, (len(cos), 3)).T[:, :, None]
    return np.hstack([x * cos + y * sin, y * cos - x * sin, z])
