"""The optimum rotor speed of a power curve: limits with a manoeuvre margin, and the engine coupled or not.

Coupled, the free turbine turns at the rotor's speed ratio, as with the aircraft's gearbox of one fixed ratio. Not
coupled, it turns at its own speed of least fuel whatever the rotor does, as with a continuously variable transmission.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from optimum_speed_curves import Curve, Flight
from scipy.interpolate import RectBivariateSpline

from vrsopt.atmosphere import standard_air
from vrsopt.drive_train import engine_power
from vrsopt.limits import Limits
from vrsopt.turboshaft.bulk import solve_many

MARGINS = (1.3, 1.0, 1.5)  # the default first, as everywhere
ENGINES = ("coupled", "own optimum")
LIMIT_NAMES = ("blade loading", "tail rotor", "engine power", "torque", "turbine temperature")
# What an optimum rests on. "fold": the trims turn back to faster rotors; "no trim": none was found further on.
ACTIVE = ("none", "lower bound", "upper bound", "fold", "no trim", *LIMIT_NAMES)


@dataclass(frozen=True)
class Engine:
    """Fuel flow [kg/s] and inter-turbine temperature [K] of one engine in one flight, by bicubic splines."""

    fuel: RectBivariateSpline
    temperature: RectBivariateSpline

    POWERS = np.linspace(20e3, 500e3, 25)
    TURBINE_SPEEDS = np.linspace(0.5, 1.3, 17)

    @classmethod
    def at(cls, altitude: float, speed: float) -> Engine:
        mach = speed / standard_air(altitude, 0.0).speed_of_sound
        shape = (len(cls.POWERS), len(cls.TURBINE_SPEEDS))
        points = [[P, n, altitude, 0.0, mach, 0.0, 0.0, 0.0] for P in cls.POWERS for n in cls.TURBINE_SPEEDS]
        found = solve_many(np.array(points))
        if not found.success.all():
            raise RuntimeError(f"engine: {len(found.failures)} points of the table not solved")
        grid = (cls.POWERS, cls.TURBINE_SPEEDS)
        names = ("fuel_flow", "power_turbine_inlet_temperature")
        return cls(*(RectBivariateSpline(*grid, found.outputs[name].reshape(shape)) for name in names))

    def run(self, power: np.ndarray, ratio: np.ndarray, *, coupled: bool) -> tuple[np.ndarray, np.ndarray]:
        """Fuel flow and temperature at ``power`` [W]: with the free turbine at the rotor's speed ``ratio``, or at the
        turbine speed of least fuel."""
        if coupled:
            speed = ratio
        else:
            speeds = np.linspace(self.TURBINE_SPEEDS[0], self.TURBINE_SPEEDS[-1], 161)
            speed = speeds[np.argmin(self.fuel(self.POWERS, speeds), axis=1)]
            speed = np.interp(power, self.POWERS, speed)
        return self.fuel.ev(power, speed), self.temperature.ev(power, speed)


@dataclass(frozen=True)
class Optimum:
    """Rotor speed of least fuel over nominal, the change of power and fuel against nominal, the band of rotor speeds
    within 0.5 % of the least fuel, and what the optimum rests on (one of ACTIVE)."""

    ratio: float
    power_change: float
    fuel_change: float
    band: tuple[float, float]
    active: str
    flyable: bool  # the nominal rotor is within all limits of engines and tail rotor


def optimum(
    curve: Curve, flight: Flight, limits: Limits, engine: Engine, *, coupled: bool, tail_limit: bool
) -> Optimum | None:
    """The rotor speed of least fuel within the limits; None where the curve does not reach the nominal rotor.

    Where the nominal rotor itself is beyond a limit, the optimum may use as much of it as the nominal rotor does.
    """
    if len(curve.ratio) < 4 or not curve.ratio[-1] <= 1.0 <= curve.ratio[0]:
        return None
    ratio = np.arange(np.ceil(1e3 * curve.ratio[-1] - 1e-6), np.floor(1e3 * curve.ratio[0] + 1e-6) + 0.5) / 1e3
    power, tail = np.exp(curve.between(np.log(curve.power), ratio)), curve.between(curve.tail_loading, ratio)
    per_engine = engine_power(limits.aircraft, limits.engine, power)
    fuel, temperature = engine.run(per_engine, ratio, coupled=coupled)
    rotor_speed = ratio * limits.aircraft.main_rotor.nominal_rotor_speed
    density = standard_air(flight.altitude, 0.0).density
    usage = np.array(
        [
            limits.blade_loading_usage(flight.mass, density, rotor_speed, flight.speed, smooth_max=np.maximum),
            limits.tail_usage(tail, rotor_speed, flight.speed) if tail_limit else np.zeros_like(ratio),
            limits.power_usage(per_engine),
            limits.torque_usage(per_engine, rotor_speed),
            limits.temperature_usage(temperature),
        ]
    )
    nominal = int(np.argmin(np.abs(ratio - 1.0)))
    allowed = np.maximum(1.0, usage[:, nominal]) + 1e-6
    inside = np.all(usage <= allowed[:, None], axis=0)
    best = int(np.argmin(np.where(inside, fuel, np.inf)))
    band = inside & (fuel <= 1.005 * fuel[best])
    low, high = best, best
    while low > 0 and band[low - 1]:
        low -= 1
    while high < len(ratio) - 1 and band[high + 1]:
        high += 1
    active = "none"
    if best == 0:
        active = curve.end if curve.end in ACTIVE else "no trim"
    elif best == len(ratio) - 1:
        active = "upper bound"
    else:
        for k in (best - 1, best + 1):
            if not inside[k] and fuel[k] < fuel[best]:
                active = LIMIT_NAMES[int(np.argmax(usage[:, k] / allowed))]
    return Optimum(
        ratio=float(ratio[best]),
        power_change=float(power[best] / power[nominal] - 1),
        fuel_change=float(fuel[best] / fuel[nominal] - 1),
        band=(float(ratio[low]), float(ratio[high])),
        active=active,
        flyable=bool(np.all(usage[1:, nominal] <= 1.0)),
    )
