"""The equations of the gas path, station by station from the intake to the exhaust.

Stations: 2 compressor inlet, 3 its exit, 4 combustor exit, 45 between the turbines, 5 power-turbine exit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from vrsopt.atmosphere import SEA_LEVEL_PRESSURE, SEA_LEVEL_TEMPERATURE, standard_air
from vrsopt.turboshaft.data import EngineData
from vrsopt.turboshaft.design_point import DesignPoint
from vrsopt.turboshaft.gas import (
    enthalpy,
    entropy_function,
    fuel_enthalpy,
    gas_constant,
    heat_capacity,
    heat_capacity_ratio,
)
from vrsopt.turboshaft.maps import (
    ComponentMaps,
    TurbineState,
    combustion_efficiency,
    combustor_loading,
    surge_margin,
)


@dataclass(frozen=True)
class State:
    """The unknowns, all but the map coordinate over their design values; temperatures as 1 + ln(T/T of the design)."""

    speed: Any  # of the gas generator
    beta: Any  # coordinate of the compressor map
    t3_ideal: Any
    t3: Any
    t4: Any
    t45_ideal: Any
    t45_uncooled: Any
    expansion: Any  # of the power turbine, y: T5 ideal = T45 exp(-y^2)
    t5: Any


class Path:
    """Scaled ``residuals`` (all but the demand) and ``outputs`` by name, in the order of the gas path.

    Humidity is per kg of dry air, flows are of moist air. The components run one after the other in the constructor.
    """

    def __init__(
        self,
        engine: EngineData,
        design: DesignPoint,
        maps: ComponentMaps,
        state: State,
        *,
        power_turbine_speed: Any,
        altitude: Any,
        isa_offset: Any,
        mach: Any,
        bleed_fraction: Any,
        power_offtake: Any,
        humidity: Any,
    ) -> None:
        self.engine, self.design, self.maps, self.state = engine, design, maps, state
        self.humidity = humidity
        self.residuals: dict[str, Any] = {}
        self.outputs: dict[str, Any] = {"gas_generator_speed": state.speed}
        self._intake(altitude, isa_offset, mach)
        self._compressor()
        self._combustor(bleed_fraction)
        self._gas_generator_turbine(power_offtake)
        self._power_turbine(power_turbine_speed)

    def _temperature(self, name: str) -> Any:
        return getattr(self.design, name) * ca.exp(getattr(self.state, name) - 1.0)

    def _intake(self, altitude: Any, isa_offset: Any, mach: Any) -> None:
        """Ram of the flight, then the losses of the intake and of what the aircraft puts before it."""
        air, fitted = standard_air(altitude, isa_offset), self.engine.installation
        total, ratio = stagnation(air.temperature, mach, self.humidity)
        self.ambient = air.pressure
        self.t2 = total + fitted.intake_temperature_rise
        lost = (1.0 - self.engine.intake.pressure_loss) * (1.0 - fitted.intake_pressure_loss)
        self.p2 = air.pressure * ratio * lost
        self.outputs["inlet_temperature"] = self.t2

    def _compressor(self) -> None:
        data, design, w = self.engine.compressor, self.design, self.humidity
        speed_unit, flow_unit = similarity(self.t2, self.p2, w)
        speed = self.state.speed / speed_unit
        flow, ratio, efficiency = self.maps.compressor(
            data, speed, self.state.beta, pressure_ratio=design.pressure_ratio
        )
        margin = surge_margin(self.maps, data, speed, at=(flow, ratio), pressure_ratio=design.pressure_ratio)
        ideal, self.t3 = self._temperature("t3_ideal"), self._temperature("t3")
        self.air, self.p3, self.h3 = design.corrected_air_flow * flow * flow_unit, self.p2 * ratio, self._h(self.t3)
        h2 = self._h(self.t2)
        self.work3 = self.h3 - h2
        rise = entropy_function(ideal, 0.0, w) - entropy_function(self.t2, 0.0, w)
        size = design.compressor_work * data.efficiency
        self.residuals["compression"] = rise / gas_constant(0.0, w) - ca.log(ratio)
        self.residuals["compressor work"] = (efficiency * self.work3 - (self._h(ideal) - h2)) / size
        self.outputs |= {
            "compressor_exit_temperature": self.t3,
            "compressor_exit_pressure": self.p3,
            "pressure_ratio": ratio,
            "air_flow": self.air,
            "compressor_efficiency": efficiency,
            "compressor_speed": speed,
            "map_coordinate": self.state.beta,
            "surge_margin": margin,
        }

    def _combustor(self, bleed: Any) -> None:
        data, design, w = self.engine.combustor, self.design, self.humidity
        burnt = self.air * (1.0 - bleed - self.engine.gas_generator_turbine.cooling_fraction)
        loading = combustor_loading(burnt, self.p3, self.t3) / design.combustor_loading
        efficiency = combustion_efficiency(data, loading)
        self.t4 = self._temperature("t4")
        # energy per kg of dry air: air and vapour are heated, the fuel brings its heat and the heat of its products
        heating = (1.0 + w) * (self._h(self.t4) - self.h3)
        self.f4 = heating / (efficiency * data.heating_value - fuel_enthalpy(self.t4))
        self.fuel = self.f4 * burnt / (1.0 + w)
        parameter = (burnt / self.p3) ** 2 * gas_constant(0.0, w) * self.t3
        self.p4 = self.p3 * (1.0 - data.pressure_loss * parameter / design.combustor_parameter)
        self.w4 = burnt + self.fuel
        unburnt = data.hydrocarbon_share * (1.0 - efficiency)
        self.outputs |= {
            "fuel_flow": self.fuel,
            "burnt_fuel_flow": (1.0 - unburnt) * self.fuel,
            "hydrocarbon_index": unburnt,
            "co2_flow": data.co2_per_fuel * self.fuel,
            "turbine_inlet_temperature": self.t4,
            "combustor_air_flow": burnt,
            "fuel_air_ratio": self.f4,
            "combustion_efficiency": efficiency,
        }

    def _gas_generator_turbine(self, offtake: Any) -> None:
        """The turbine and its shaft, the cooling air that joins behind it, and the duct to the power turbine."""
        data, design, w, speed = self.engine.gas_generator_turbine, self.design, self.humidity, self.state.speed
        ideal, uncooled = self._temperature("t45_ideal"), self._temperature("t45_uncooled")
        gas, h4 = gas_constant(self.f4, w), enthalpy(self.t4, self.f4, w)
        fall = entropy_function(self.t4, self.f4, w) - entropy_function(ideal, self.f4, w)
        ratio, drop, h45 = ca.exp(fall / gas), h4 - enthalpy(ideal, self.f4, w), enthalpy(uncooled, self.f4, w)
        theta = gas * self.t4 / (gas_constant(design.fuel_flow / self._burnt_at_design) * design.t4)
        flow, work = self.maps.gas_generator_turbine(
            data,
            TurbineState(
                speed,
                speed / ca.sqrt(theta),
                ca.sqrt(drop / design.gas_generator_drop),
                ratio,
                design.gas_generator_expansion,
            ),
        )
        taken = self.air * self.work3 / data.mechanical_efficiency + data.accessory_power * speed + offtake
        size = data.efficiency * design.gas_generator_drop
        through = (self.w4 / self.p4) ** 2 * gas * self.t4
        self.residuals["gas-generator turbine flow"] = through / design.gas_generator_constant - flow
        self.residuals["gas-generator turbine work"] = (h4 - h45) / size - work
        self.residuals["gas-generator shaft"] = (self.w4 * (h4 - h45) - taken) / (
            design.air_flow * design.compressor_work
        )
        self._mix(data.cooling_fraction * self.air, h45, uncooled)
        self._duct(self.p4 / ratio)

    @property
    def _burnt_at_design(self) -> float:
        return self.design.air_flow * (1.0 - self.engine.gas_generator_turbine.cooling_fraction)

    def _mix(self, cooling: Any, enthalpy_uncooled: Any, start: Any) -> None:
        w = self.humidity
        self.w45 = self.w4 + cooling
        self.f45 = self.fuel * (1.0 + w) / (self.w45 - self.fuel)
        self.h45 = (self.w4 * enthalpy_uncooled + cooling * self.h3) / self.w45
        t45 = start  # mixing changes it by some 10 K: two Newton steps are exact to 1e-8 K
        for _ in range(2):
            t45 = t45 - (enthalpy(t45, self.f45, w) - self.h45) / heat_capacity(t45, self.f45, w)
        self.t45, self.gas45 = t45, gas_constant(self.f45, w)
        self.outputs["power_turbine_inlet_temperature"] = t45

    def _duct(self, pressure: Any) -> None:
        parameter = (self.w45 / pressure) ** 2 * self.gas45 * self.t45
        loss = self.engine.power_turbine.duct_pressure_loss * parameter / self.design.duct_parameter
        self.p45 = pressure * (1.0 - loss)

    def _power_turbine(self, speed: Any) -> None:
        """The free turbine with its gear, and the exhaust behind it."""
        data, design, w, f = self.engine.power_turbine, self.design, self.humidity, self.f45
        t5 = self._temperature("t5")
        ideal = self.t45 * ca.exp(-((design.expansion * self.state.expansion) ** 2))
        fall = entropy_function(self.t45, f, w) - entropy_function(ideal, f, w)
        ratio = ca.exp(fall / self.gas45)
        spouting = ca.sqrt((self.h45 - enthalpy(ideal, f, w)) / design.power_turbine_drop)
        theta = self.gas45 * self.t45 / (gas_constant(design.fuel_flow / design.air_flow) * design.t45)
        flow, work = self.maps.power_turbine(
            data, TurbineState(speed, speed / ca.sqrt(theta), spouting, ratio, design.power_turbine_expansion)
        )
        h5, p5 = enthalpy(t5, f, w), self.p45 / ratio
        size = design.power_turbine_efficiency * design.power_turbine_drop
        through = (self.w45 / self.p45) ** 2 * self.gas45 * self.t45
        leaving = design.exhaust_constant * (self.w45 / p5) ** 2 * self.gas45 * t5
        back = 1.0 + self.engine.installation.exhaust_back_pressure
        self.residuals["power turbine flow"] = through / design.power_turbine_constant - flow
        self.residuals["power turbine work"] = (self.h45 - h5) / size - work
        self.residuals["exhaust"] = p5 / self.ambient - back - leaving
        self.outputs |= {
            "power": data.mechanical_efficiency * self.w45 * (self.h45 - h5),
            "exhaust_temperature": t5,
            "best_power_turbine_speed": data.best_velocity_ratio * spouting,
        }

    def _h(self, temperature: Any) -> Any:
        """Enthalpy of the moist air [J/kg]."""
        return enthalpy(temperature, 0.0, self.humidity)


def stagnation(temperature: Any, mach: Any, humidity: Any) -> tuple[Any, Any]:
    """Stagnation temperature [K] and stagnation over static pressure of humid air at static ``temperature`` [K]."""
    gas = gas_constant(0.0, humidity)
    kinetic = 0.5 * mach**2 * heat_capacity_ratio(temperature, 0.0, humidity) * gas * temperature
    still, total = enthalpy(temperature, 0.0, humidity), temperature * (1.0 + 0.2 * mach**2)
    for _ in range(2):  # exact to 1e-9 K below Mach 0.5
        total = total - (enthalpy(total, 0.0, humidity) - still - kinetic) / heat_capacity(total, 0.0, humidity)
    rise = entropy_function(total, 0.0, humidity) - entropy_function(temperature, 0.0, humidity)
    return total, ca.exp(rise / gas)


def similarity(temperature: Any, pressure: Any, humidity: Any) -> tuple[Any, Any]:
    """Units of speed, sqrt(gamma R T), and of flow, P sqrt(gamma / (R T)), at a compressor's inlet over their values in
    dry air at 288.15 K and 101325 Pa: equal Mach numbers at equal speed and flow over these units.

    ``temperature`` [K] and ``pressure`` [Pa] are stagnation values, ``humidity`` [kg/kg].
    """
    gas = gas_constant(0.0, humidity) / gas_constant()
    gamma = heat_capacity_ratio(temperature, 0.0, humidity) / heat_capacity_ratio(SEA_LEVEL_TEMPERATURE)
    theta = gas * temperature / SEA_LEVEL_TEMPERATURE
    return ca.sqrt(gamma * theta), pressure / SEA_LEVEL_PRESSURE * ca.sqrt(gamma / theta)
