"""What the aircraft is allowed to do: blade loading, engine power, torque, turbine temperature, tail-rotor loading.

Every limit is a usage: value over allowed value, 1 at the limit. The same expressions serve the classification of an
operating point (floats), the surrogate along a mission (arrays) and the optimal-control problem (CasADi).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from vrsopt.aircraft import Aircraft
from vrsopt.atmosphere import GRAVITY
from vrsopt.drive_train import smooth_max
from vrsopt.rotor.airfoil import polynomial
from vrsopt.turboshaft.data import EngineData
from vrsopt.turboshaft.performance import temperature_limit

Setting = Literal["manual", "study"]
HIGHEST_DEGREE = 3  # of the polynomial through the blade-loading table
SMALLEST_LIMIT = 0.02  # thrust coefficient over solidity far beyond the table
ROUNDING = 4e-4  # of a usage, over which the margin of smooth problems gives way to what the nominal rotor has
MARGINS = (1.0, 2.0)  # least and largest manoeuvre margin that may be asked for
LIMIT_NAMES = ("blade loading", "engine power", "torque", "turbine temperature", "tail rotor loading")


@dataclass(frozen=True)
class Limits:
    """Limits of an aircraft and its engine.

    setting "manual": the flight manual's rated power per engine, and that power's torque at lower rotor speed.
    setting "study": the engine's take-off rating, no torque limit. ``manoeuvre_margin`` divides the blade-loading
    limit: 1.3 leaves 1.3 times the flown thrust available. With ``one_engine_inoperative`` the manual's rating is that
    of an engine left alone, and never more than the engine's own take-off rating.
    """

    aircraft: Aircraft
    engine: EngineData
    setting: Setting = "manual"
    manoeuvre_margin: float = 1.0
    one_engine_inoperative: bool = False

    @cached_property
    def _blade_loading_polynomial(self) -> tuple[float, ...]:
        """Least-squares cubic of the aircraft's table, constant term first: smooth where a table has corners."""
        table = self.aircraft.blade_loading_limit
        degree = min(len(table.advance_ratio) - 1, HIGHEST_DEGREE)
        fit = np.polynomial.Polynomial.fit(table.advance_ratio, table.thrust_over_solidity, deg=degree)
        return tuple(fit.convert().coef.tolist())

    def _largest_loading(self, advance_ratio: Any) -> Any:
        """Largest thrust coefficient over solidity; beyond the table it falls to a small positive value."""
        fitted = polynomial(self._blade_loading_polynomial, advance_ratio)
        return smooth_max(fitted, SMALLEST_LIMIT, 1e-6)

    @property
    def rated_power(self) -> float:
        """Largest power of one engine [W]."""
        own, drive = self.engine.ratings.take_off_power, self.aircraft.transmission
        if self.setting == "study":
            return own
        if self.one_engine_inoperative:
            return min(own, 1e3 * drive.one_engine_inoperative_power)
        return 1e3 * drive.rated_power_per_engine

    @property
    def temperature(self) -> float:
        """Largest inter-turbine temperature [K]."""
        return temperature_limit(self.engine)

    @property
    def stated(self) -> dict[str, tuple[float, str]]:
        """What a usage of 1 stands for, with its unit, for people: those limits that are one number."""
        nominal = self.aircraft.main_rotor.nominal_rotor_speed
        found = {"engine power": (self.rated_power / 1e3, "kW"), "turbine temperature": (self.temperature, "K")}
        if self.setting == "manual":
            engines = self.aircraft.transmission.engines
            found["torque"] = (engines * self.rated_power / nominal, "N m")
        return found

    def blade_loading(self, weight: Any, density: Any, rotor_speed: Any, speed: Any) -> tuple[Any, Any]:
        """Blade loading n m g / (rho A_b (Omega R)^2) and its largest value, without the manoeuvre margin.

        weight: load factor times mass [kg].
        """
        rotor = self.aircraft.main_rotor
        tip_speed = rotor_speed * rotor.radius
        loading = weight * GRAVITY / (density * rotor.blade_area * tip_speed**2)
        return loading, self._largest_loading(speed / tip_speed)

    def blade_loading_usage(self, weight: Any, density: Any, rotor_speed: Any, speed: Any, *, smooth_max: Any) -> Any:
        """Blade loading over what is allowed: with the manoeuvre margin, or, where the rotor at nominal speed itself
        has less than the margin, at least the nominal rotor's."""
        loading, largest = self.blade_loading(weight, density, rotor_speed, speed)
        nominal = self.blade_loading(weight, density, self.aircraft.main_rotor.nominal_rotor_speed, speed)
        allowed = smooth_max(1.0 / self.manoeuvre_margin, nominal[0] / nominal[1])
        return loading / largest / allowed

    def usages(
        self,
        weight: Any,
        rotor_speed: Any,
        *,
        speed: Any,
        density: Any,
        power: Any,
        temperature: Any,
        tail_loading: Any,
        larger: Any = lambda a, b: smooth_max(a, b, ROUNDING),
    ) -> dict[str, Any]:
        """Usage of each limit, 1 at the limit, in the order of LIMIT_NAMES; numbers, arrays and CasADi expressions.

        weight: load factor times mass [kg]; power [W] and inter-turbine temperature [K] of one engine; ``larger``: the
        maximum of two, rounded by default.
        """
        return {
            "blade loading": self.blade_loading_usage(weight, density, rotor_speed, speed, smooth_max=larger),
            "engine power": self.power_usage(power),
            "torque": self.torque_usage(power, rotor_speed),
            "turbine temperature": self.temperature_usage(temperature),
            "tail rotor loading": self.tail_usage(tail_loading, rotor_speed, speed),
        }

    def power_usage(self, power_per_engine: Any) -> Any:
        """Power of one engine over its rating."""
        return power_per_engine / self.rated_power

    def torque_usage(self, power_per_engine: Any, rotor_speed: Any) -> Any:
        """Torque over the rated one; zero where the setting has no torque limit."""
        if self.setting == "study":
            return 0.0 * power_per_engine
        ratio = rotor_speed / self.aircraft.main_rotor.nominal_rotor_speed
        return power_per_engine / (self.rated_power * ratio)

    def temperature_usage(self, inter_turbine_temperature: Any) -> Any:
        """Inter-turbine temperature over its limit."""
        return inter_turbine_temperature / self.temperature

    def tail_usage(self, tail_blade_loading: Any, rotor_speed: Any, speed: Any) -> Any:
        """Tail-rotor thrust coefficient over solidity over its largest value at the tail rotor's advance ratio."""
        tail = self.aircraft.tail_rotor
        tip_speed = rotor_speed * tail.speed_ratio * tail.radius
        fraction = self.aircraft.blade_loading_limit.tail_rotor_fraction
        return tail_blade_loading / (fraction * self._largest_loading(speed / tip_speed))
