"""Sizing: the constants of the gas path from the engine's design point, station by station.

Power, consumption, air flow and pressure ratio are given; the heat balance then fixes every temperature, the
gas-generator's shaft balance its turbine's expansion, and what is left of the pressure the power turbine's efficiency.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from scipy.optimize import brentq

from vrsopt.atmosphere import SEA_LEVEL_PRESSURE, SEA_LEVEL_TEMPERATURE
from vrsopt.errors import InputError
from vrsopt.turboshaft.data import EngineData
from vrsopt.turboshaft.gas import enthalpy, entropy_function, fuel_enthalpy, gas_constant

COLDEST, HOTTEST = 150.0, 2200.0  # K, where temperatures are looked for
SPEED_UNIT = 3.6e6  # J per kWh


@dataclass(frozen=True)
class DesignPoint:
    """Design point and the constants of the flow functions. Temperatures K, works J/kg, flows kg/s, pressures Pa.

    Stations: 2 compressor inlet, 3 its exit, 4 combustor exit, 45 between the turbines, 5 power-turbine exit; ``ideal``
    is isentropic, ``uncooled`` before the cooling air is mixed in.
    """

    power: float
    air_flow: float
    corrected_air_flow: float
    fuel_flow: float
    pressure_ratio: float
    compressor_exit_pressure: float
    compressor_work: float
    t3_ideal: float
    t3: float
    t4: float
    t45_ideal: float
    t45_uncooled: float
    t45: float
    t5: float
    gas_generator_drop: float  # isentropic enthalpy drop of the gas-generator turbine
    power_turbine_drop: float  # isentropic enthalpy drop of the power turbine
    power_turbine_efficiency: float
    expansion: float  # y0: T5 ideal = T45 exp(-y0^2)
    combustor_parameter: float  # W^2 R T/P^2 at the combustor inlet
    gas_generator_constant: float  # W sqrt(R T)/P of the choked gas-generator turbine
    duct_parameter: float  # W^2 R T/P^2 of the duct between the turbines
    power_turbine_constant: float  # W sqrt(R T)/P of the choked power turbine
    exhaust_constant: float  # exhaust loss over W^2 R T/P^2


def _temperature(function: Callable[[float], float], value: float, what: str, engine: str) -> float:
    if not function(COLDEST) < value < function(HOTTEST):
        raise InputError(
            f"{engine}: design_point: no {what} between {COLDEST:.0f} and {HOTTEST:.0f} K closes the balance"
        )
    return float(brentq(lambda t: function(t) - value, COLDEST, HOTTEST, xtol=1e-12, rtol=1e-14, maxiter=200))


def design_point(engine: EngineData) -> DesignPoint:
    """Size the gas path of ``engine``; raises :class:`InputError` when its design point can not be closed."""
    given, ggt, pt = engine.design_point, engine.gas_generator_turbine, engine.power_turbine
    name = engine.name
    air, fuel = given.air_flow, given.sfc * given.power / SPEED_UNIT
    ambient, t2 = SEA_LEVEL_PRESSURE, SEA_LEVEL_TEMPERATURE
    p2 = ambient * (1.0 - engine.intake.pressure_loss)
    p3 = p2 * given.pressure_ratio

    t3_ideal = _temperature(
        entropy_function, entropy_function(t2) + gas_constant() * math.log(given.pressure_ratio), "T3", name
    )
    work = (enthalpy(t3_ideal) - enthalpy(t2)) / engine.compressor.efficiency
    h3 = enthalpy(t2) + work
    t3 = _temperature(enthalpy, h3, "T3", name)

    burnt = air * (1.0 - ggt.cooling_fraction)
    f4 = fuel / burnt
    heat = h3 + f4 * engine.combustor.efficiency * engine.combustor.heating_value
    t4 = _temperature(lambda t: enthalpy(t) + f4 * fuel_enthalpy(t), heat, "T4", name)
    p4 = p3 * (1.0 - engine.combustor.pressure_loss)

    w4 = burnt + fuel
    shaft = air * work / ggt.mechanical_efficiency + ggt.accessory_power
    h4 = enthalpy(t4, f4)
    drop = shaft / w4 / ggt.efficiency
    t45_uncooled = _temperature(lambda t: enthalpy(t, f4), h4 - shaft / w4, "T45", name)
    t45_ideal = _temperature(lambda t: enthalpy(t, f4), h4 - drop, "T45", name)
    ratio_gg = math.exp((entropy_function(t4, f4) - entropy_function(t45_ideal, f4)) / gas_constant(f4))
    p45_uncooled = p4 / ratio_gg

    w45, f45 = air + fuel, fuel / air
    h45 = (w4 * enthalpy(t45_uncooled, f4) + (air - burnt) * h3) / w45
    t45 = _temperature(lambda t: enthalpy(t, f45), h45, "T45", name)
    p45 = p45_uncooled * (1.0 - pt.duct_pressure_loss)

    p5 = ambient * (1.0 + engine.exhaust.pressure_loss)
    ratio_pt = p45 / p5
    if ratio_pt <= 1.05:
        raise InputError(f"{name}: design_point: power-turbine expansion {ratio_pt:.3f}: more than 1.05 needed")
    entropy5 = entropy_function(t45, f45) - gas_constant(f45) * math.log(ratio_pt)
    t5_ideal = _temperature(lambda t: entropy_function(t, f45), entropy5, "T5", name)
    pt_drop = h45 - enthalpy(t5_ideal, f45)
    pt_work = given.power / pt.mechanical_efficiency / w45
    t5 = _temperature(lambda t: enthalpy(t, f45), h45 - pt_work, "T5", name)
    if not 0.5 < pt_work / pt_drop < 0.95:
        raise InputError(
            f"{name}: design_point: needs a power-turbine efficiency of {pt_work / pt_drop:.3f}: 0.5 to 0.95 allowed"
        )
    return DesignPoint(
        power=given.power,
        air_flow=air,
        corrected_air_flow=air * SEA_LEVEL_PRESSURE / p2,
        fuel_flow=fuel,
        pressure_ratio=given.pressure_ratio,
        compressor_exit_pressure=p3,
        compressor_work=work,
        t3_ideal=t3_ideal,
        t3=t3,
        t4=t4,
        t45_ideal=t45_ideal,
        t45_uncooled=t45_uncooled,
        t45=t45,
        t5=t5,
        gas_generator_drop=drop,
        power_turbine_drop=pt_drop,
        power_turbine_efficiency=pt_work / pt_drop,
        expansion=math.sqrt(math.log(t45 / t5_ideal)),
        combustor_parameter=(burnt / p3) ** 2 * gas_constant() * t3,
        gas_generator_constant=w4
        * math.sqrt(gas_constant(f4) * t4)
        / p4
        / math.sqrt(1.0 - ratio_gg**-ggt.flow_exponent),
        duct_parameter=(w45 / p45_uncooled) ** 2 * gas_constant(f45) * t45,
        power_turbine_constant=w45
        * math.sqrt(gas_constant(f45) * t45)
        / p45
        / math.sqrt(1.0 - ratio_pt**-pt.flow_exponent),
        exhaust_constant=engine.exhaust.pressure_loss / ((w45 / p5) ** 2 * gas_constant(f45) * t5),
    )
