"""An analytic helicopter and hand-made profiles, so that schedules are tested without surrogate and mission files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import pytest

from tests.schedule.smooth_profiles import jumping_profile
from vrsopt.mission.profile import Profile
from vrsopt.schedule.path_model import PathValues
from vrsopt.schedule.path_quantities import checked_quantities

GRAVITY, RADIUS, BLADE_AREA = 9.80665, 4.912, 5.305
DISK_AREA = np.pi * RADIUS**2


@dataclass(frozen=True)
class Aircraft:
    """Settings of the analytic helicopter."""

    inertia: float = 973.0  # kg m2
    power_limit: float = 257e3  # W per engine
    torque_limit: float = 257e3 / 44.4  # N m per engine
    blade_loading_limit: float = 0.1
    constant_fuel: float | None = None  # kg/s: fuel flow proportional to mass, for a known solution

    def outputs(self, mass: Any, omega: Any, twist: Any, rate: Any, c: Any, lib: Any) -> tuple[Any, Any, list[Any]]:
        """Fuel flow, power per engine and limits; ``c`` are speed, density, sin(climb), load factor, idle."""
        speed, rho, climb, load, idle = c
        sqrt = lib.sqrt
        thrust = load * mass * GRAVITY
        tip = omega * RADIUS
        vh2 = thrust / (2 * rho * DISK_AREA)
        induced_velocity = sqrt((sqrt(speed**4 + 4 * vh2**2) - speed**2) / 2)
        best_twist = 0.24 - 0.0022 * speed
        kappa = 1.12 + 6.0 * (twist - best_twist) ** 2
        loading = thrust / (rho * BLADE_AREA * tip**2)
        drag = 0.0095 * (1 + 4e3 * loading**4) * (1 + 60.0 * (tip / 340.0) ** 12)
        profile = rho * BLADE_AREA * tip**3 * drag / 8 * (1 + 4.65 * (speed / tip) ** 2)
        power = (
            kappa * thrust * induced_velocity + profile + 0.5 * rho * 1.1 * speed**3 + mass * GRAVITY * speed * climb
        )
        shaft = power * 1.1 + 12e3 + self.inertia * omega * rate
        least = 20e3
        per_engine = (shaft / 2 + least + sqrt((shaft / 2 - least) ** 2 + 2e3**2)) / 2
        per_engine = idle * 45e3 + (1 - idle) * per_engine
        p = per_engine / 300e3
        ratio = omega / 44.4
        engine = (0.0062 + 0.0225 * p + 0.0032 * p**2) * (1 + 0.25 * (ratio - 0.95 - 0.1 * (p - 0.6)) ** 2)
        fuel_flow = 2 * engine if self.constant_fuel is None else self.constant_fuel * mass
        limits = [
            loading / self.blade_loading_limit - 1,
            per_engine / self.power_limit - 1,
            per_engine / omega / self.torque_limit - 1,
        ]
        return fuel_flow, per_engine, limits


class AnalyticModel:
    """The analytic helicopter along nodes, as a path model."""

    limit_names = ("blade loading", "engine power", "torque")
    quantity_names = ("power_per_engine", "torque", "turbine_temperature", "blade_loading", "nox", "co", "co2")
    bounds = {"mass": (1400.0, 2500.0), "rotor_speed": (33.0, 51.5), "twist": (0.1, 0.29)}

    def __init__(self, aircraft: Aircraft, coefficients: np.ndarray) -> None:
        self.aircraft, self.coefficients = aircraft, coefficients
        self.polar_inertia, self.engine_share = aircraft.inertia, 0.5

    def evaluate(self, mass: Any, rotor_speed: Any, twist: Any, rotor_speed_rate: Any = 0.0) -> PathValues:
        arguments = np.broadcast_arrays(mass, rotor_speed, twist, rotor_speed_rate)
        shape = (-1,) + (1,) * (arguments[0].ndim - 1)
        c = [row.reshape(shape) for row in self.coefficients]
        fuel_flow, power, limits = self.aircraft.outputs(*arguments, c, np)
        return PathValues(fuel_flow, power, np.stack(limits))

    def emissions(self, fuel_flow: Any, power_per_engine: Any, rotor_speed: Any) -> dict[str, Any]:
        nox = 5e-3 * fuel_flow * (power_per_engine / 200e3)
        return {"co2": 3.1 * fuel_flow, "nox": nox, "co": 2e-2 * fuel_flow * rotor_speed / 44.4, "nox_other": 0.9 * nox}

    def nodes(self, index: np.ndarray) -> AnalyticModel:
        return AnalyticModel(self.aircraft, self.coefficients[:, index])

    def function(self, quantities: Sequence[str] = ()) -> tuple[ca.Function, np.ndarray]:
        x, c = [ca.SX.sym(name) for name in ("mass", "omega", "twist", "rate")], ca.SX.sym("c", 5)
        fuel_flow, power, limits = self.aircraft.outputs(*x, ca.vertsplit(c), ca)
        outputs = [fuel_flow, ca.vertcat(*limits)]
        if quantities:
            values = {
                "power_per_engine": power,
                "torque": 2 * power / x[1],
                "turbine_temperature": 700.0 + 1.5e-3 * power,
                "blade_loading": self.aircraft.blade_loading_limit * (limits[0] + 1),
                **self.emissions(fuel_flow, power, x[1]),
            }
            outputs.append(ca.vertcat(*(values[name] for name in checked_quantities(quantities, self.quantity_names))))
        return ca.Function("node", [*x, c], outputs), self.coefficients


def maker(**settings: Any) -> Callable[[Any], AnalyticModel]:
    """Factory of analytic path models with these aircraft settings."""
    aircraft = Aircraft(**settings)

    def make(conditions: Any) -> AnalyticModel:
        rho = 1.225 * (1 - 2.2558e-5 * conditions.altitude) ** 4.2559
        idle = conditions.idle.astype(float)
        rows = [conditions.speed, rho, np.sin(conditions.equivalent_climb_angle), conditions.load_factor, idle]
        return AnalyticModel(aircraft, np.array(rows, dtype=float))

    return make


@pytest.fixture(scope="session")
def make_model() -> Callable[..., Callable[[Any], AnalyticModel]]:
    return maker


@pytest.fixture(scope="session")
def make_profile() -> Callable[..., Profile]:
    return jumping_profile


@pytest.fixture(scope="session")
def transport() -> Profile:
    """Two flights with a stop: idle, hover, climb, cruise, descent, pick-up."""
    climb = np.radians(7.12)
    return jumping_profile(
        {"task": "idle", "duration": 60.0},
        {"task": "hover", "duration": 60.0},
        {"task": "climb", "duration": 80.0, "speed": 40.0, "climb": climb},
        {"task": "cruise", "duration": 400.0, "speed": 58.0},
        {"task": "descent", "duration": 70.0, "speed": 40.0, "climb": -climb},
        {"task": "hover", "duration": 45.0},
        {"task": "idle", "duration": 90.0, "mass_change": 150.0},
        {"task": "hover", "duration": 45.0},
        {"task": "climb", "duration": 60.0, "speed": 40.0, "climb": climb},
        {"task": "loiter", "duration": 300.0, "speed": 30.0, "load": 1.1},
        {"task": "descent", "duration": 70.0, "speed": 40.0, "climb": -climb},
        {"task": "hover", "duration": 60.0},
        {"task": "idle", "duration": 30.0},
    )


@pytest.fixture(scope="session")
def search() -> Profile:
    """A rescue mission: transits, 18 search legs of 114 s with turns of 18 s, a pick-up in the hover."""
    climb = np.radians(7.12)
    pattern: list[dict[str, Any]] = []
    for leg in range(18):
        pattern.append({"task": "search", "duration": 114.0, "speed": 35.0})
        if leg < 17:
            pattern.append({"task": "search", "duration": 18.0, "speed": 35.0, "load": 1.18})
    return jumping_profile(
        {"task": "idle", "duration": 120.0},
        {"task": "hover", "duration": 60.0},
        {"task": "climb", "duration": 60.0, "speed": 40.0, "climb": climb},
        {"task": "cruise", "duration": 600.0, "speed": 48.0},
        {"task": "descent", "duration": 50.0, "speed": 40.0, "climb": -climb},
        *pattern,
        {"task": "pick-up", "kind": "hover", "duration": 180.0, "mass_change": 240.0},
        {"task": "climb", "duration": 54.0, "speed": 40.0, "climb": climb},
        {"task": "cruise", "duration": 900.0, "speed": 48.0},
        {"task": "descent", "duration": 60.0, "speed": 40.0, "climb": -climb},
        {"task": "hover", "duration": 60.0},
        {"task": "idle", "duration": 180.0, "mass_change": -240.0},
        {"task": "hover", "duration": 45.0},
        {"task": "climb", "duration": 60.0, "speed": 40.0, "climb": climb},
        {"task": "cruise", "duration": 500.0, "speed": 48.0},
        {"task": "descent", "duration": 60.0, "speed": 40.0, "climb": -climb},
        {"task": "hover", "duration": 60.0},
        {"task": "idle", "duration": 60.0},
    )
