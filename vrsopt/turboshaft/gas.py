"""Thermal properties of air and of the products of lean kerosene combustion.

Complete combustion is exactly linear in the fuel-air ratio, so every mass-specific property is that of air plus the
fuel-air ratio times that of the "theoretical products minus oxygen" gas. Both are degree-7 polynomials of temperature,
valid 220..1800 K, fitted to NASA polynomials of the mixture (largest error 0.06 K).
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

REFERENCE_TEMPERATURE = 298.15  # K, where enthalpies are zero and the heating value is given
AIR_CONSTANT = 287.04799  # J/(kg K)
FUEL_CONSTANT = 285.74424  # J/(kg K), per unit of fuel-air ratio

# cp [J/(kg K)] = sum a_i (T/1000)^i
_AIR = (954.6740447, 602.5113284, -3104.706822, 7945.219145, -9763.475696, 6308.530042, -2078.171213, 275.9322792)
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


def heat_capacity(temperature: Any, fuel_air_ratio: Any = 0.0) -> Any:
    """Heat capacity at constant pressure [J/(kg K)] at temperature [K]; floats, arrays or CasADi expressions."""
    return (_heat(_AIR, temperature) + fuel_air_ratio * _heat(_FUEL, temperature)) / (1.0 + fuel_air_ratio)


def enthalpy(temperature: Any, fuel_air_ratio: Any = 0.0) -> Any:
    """Sensible enthalpy [J/kg] above 298.15 K."""
    return (_enthalpy(_AIR, temperature) + fuel_air_ratio * _enthalpy(_FUEL, temperature)) / (1.0 + fuel_air_ratio)


def entropy_function(temperature: Any, fuel_air_ratio: Any = 0.0) -> Any:
    """Integral of cp/T [J/(kg K)]: an isentropic change has d(phi) = R d(ln P)."""
    return (_entropy(_AIR, temperature) + fuel_air_ratio * _entropy(_FUEL, temperature)) / (1.0 + fuel_air_ratio)


def gas_constant(fuel_air_ratio: Any = 0.0) -> Any:
    """Gas constant [J/(kg K)]."""
    return (AIR_CONSTANT + fuel_air_ratio * FUEL_CONSTANT) / (1.0 + fuel_air_ratio)


def fuel_enthalpy(temperature: Any) -> Any:
    """Enthalpy [J/kg] that unit fuel-air ratio adds to a kilogram of air."""
    return _enthalpy(_FUEL, temperature)
