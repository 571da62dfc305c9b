"""Thermal properties of humid air and of the products of lean kerosene combustion.

Complete combustion is exactly linear in the fuel-air ratio, so a mass-specific property is a sum over three gases: dry
air, water vapour, and "theoretical products minus oxygen" of the fuel, X = (Xa + w Xw + f Xth) / (1 + w + f), with
humidity w and fuel-air ratio f per kg of DRY air. All three are degree-7 polynomials of temperature, valid 220..1800 K,
fitted to the seven-coefficient polynomials of the NASA thermodynamic database (largest error of the mixtures 0.1 K of
enthalpy or entropy). Dry air is 78.084 % N2, 20.9476 % O2, 0.9365 % Ar and 0.0319 % CO2 by moles; the fuel is C12H23.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

REFERENCE_TEMPERATURE = 298.15  # K, where enthalpies are zero and the heating value is given
COLDEST, HOTTEST = 220.0, 1800.0  # K, between which the fits hold
AIR_CONSTANT = 287.04799  # J/(kg K)
VAPOUR_CONSTANT = 461.52998  # J/(kg K)
FUEL_CONSTANT = 285.74424  # J/(kg K), per unit of fuel-air ratio

# cp [J/(kg K)] = sum a_i (T/1000)^i
_AIR = (954.6740447, 602.5113284, -3104.706822, 7945.219145, -9763.475696, 6308.530042, -2078.171213, 275.9322792)
_VAPOUR = (2109.462054, -2761.383249, 10582.59275, -18459.06274, 19056.24607, -11350.52121, 3577.523945, -461.2469706)
_FUEL = (526.4222579, 6065.991647, -5171.773525, -3846.272405, 13629.66725, -12331.39146, 4897.714279, -737.3803283)


def _log(value: Any) -> Any:
    return ca.log(value) if isinstance(value, ca.SX | ca.MX | ca.DM) else np.log(value)


def _horner(coefficients: tuple[float, ...], z: Any) -> Any:
    total: Any = 0.0
    for coefficient in reversed(coefficients):
        total = total * z + coefficient
    return total


def _heat(a: tuple[float, ...], temperature: Any) -> Any:
    return _horner(a, temperature / 1000.0)


def _enthalpy(a: tuple[float, ...], temperature: Any) -> Any:
    integral = (0.0, *(1000.0 * value / (i + 1) for i, value in enumerate(a)))
    return _horner(integral, temperature / 1000.0) - _horner(integral, REFERENCE_TEMPERATURE / 1000.0)


def _entropy(a: tuple[float, ...], temperature: Any) -> Any:
    integral = (0.0, *(value / i for i, value in enumerate(a) if i > 0))
    return a[0] * _log(temperature) + _horner(integral, temperature / 1000.0)


def _mixed(parts: Sequence[Any], fuel_air_ratio: Any, humidity: Any) -> Any:
    air, vapour, fuel = parts
    return (air + humidity * vapour + fuel_air_ratio * fuel) / (1.0 + humidity + fuel_air_ratio)


def heat_capacity(temperature: Any, fuel_air_ratio: Any = 0.0, humidity: Any = 0.0) -> Any:
    """Heat capacity at constant pressure [J/(kg K)] at temperature [K]; floats, arrays or CasADi expressions."""
    return _mixed([_heat(a, temperature) for a in (_AIR, _VAPOUR, _FUEL)], fuel_air_ratio, humidity)


def enthalpy(temperature: Any, fuel_air_ratio: Any = 0.0, humidity: Any = 0.0) -> Any:
    """Sensible enthalpy [J/kg] above 298.15 K."""
    return _mixed([_enthalpy(a, temperature) for a in (_AIR, _VAPOUR, _FUEL)], fuel_air_ratio, humidity)


def entropy_function(temperature: Any, fuel_air_ratio: Any = 0.0, humidity: Any = 0.0) -> Any:
    """Integral of cp/T [J/(kg K)]: an isentropic change has d(phi) = R d(ln P)."""
    return _mixed([_entropy(a, temperature) for a in (_AIR, _VAPOUR, _FUEL)], fuel_air_ratio, humidity)


def gas_constant(fuel_air_ratio: Any = 0.0, humidity: Any = 0.0) -> Any:
    """Gas constant [J/(kg K)]."""
    return _mixed((AIR_CONSTANT, VAPOUR_CONSTANT, FUEL_CONSTANT), fuel_air_ratio, humidity)


def heat_capacity_ratio(temperature: Any, fuel_air_ratio: Any = 0.0, humidity: Any = 0.0) -> Any:
    """cp / cv at temperature [K]."""
    cp = heat_capacity(temperature, fuel_air_ratio, humidity)
    return cp / (cp - gas_constant(fuel_air_ratio, humidity))


def fuel_enthalpy(temperature: Any) -> Any:
    """Enthalpy [J] that unit fuel-air ratio adds to a kilogram of dry air."""
    return _enthalpy(_FUEL, temperature)
