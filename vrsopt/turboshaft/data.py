"""The engine as data: design point, losses, map parameters and limits, each with unit and source, from TOML."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from vrsopt.combustor.data import ReactorData
from vrsopt.errors import InputError
from vrsopt.quantity import Record, Unit, read_toml, validated

DEFAULT_ENGINE = "allison_250_c20b"

Number = Annotated[float, Unit("-")]
Positive = Annotated[float, Unit("-"), Field(gt=0)]
Fraction = Annotated[float, Unit("-"), Field(ge=0, lt=0.5)]
Efficiency = Annotated[float, Unit("-"), Field(ge=0.5, le=1)]
Watt = Annotated[float, Unit("W"), Field(ge=0)]


class DesignPointData(Record):
    """Sea level static, ISA, both shafts at 100 %."""

    power: Annotated[float, Unit("W"), Field(gt=0)]
    sfc: Annotated[float, Unit("kg/kWh"), Field(gt=0)]
    air_flow: Annotated[float, Unit("kg/s"), Field(gt=0)]
    pressure_ratio: Annotated[float, Unit("-"), Field(gt=1.5, lt=30)]


class IntakeData(Record):
    """Intake: total-pressure loss."""

    pressure_loss: Fraction


class CompressorData(Record):
    """Compressor: design efficiency and shape of the map (see :mod:`vrsopt.turboshaft.maps`)."""

    efficiency: Efficiency
    flow_speed_exponent: Positive
    pressure_speed_exponent: Positive
    flow_spread: Positive
    flow_spread_exponent: Number
    choke_sharpness: Positive
    pressure_spread: Positive
    efficiency_curvature: Number
    efficiency_slope: Number
    efficiency_beta_curvature: Number
    surge_coordinate: Annotated[float, Unit("-"), Field(lt=0)]
    choke_coordinate: Annotated[float, Unit("-"), Field(gt=0)]
    slowest_line: Positive
    fastest_line: Positive


class CombustorData(Record):
    """Combustor: fuel, combustion efficiency and its fall with loading, pressure loss.

    ``hydrocarbon_share``: part of the combustion loss that is unburnt fuel; the rest of the loss is CO.
    """

    heating_value: Annotated[float, Unit("J/kg"), Field(gt=0)]
    efficiency: Annotated[float, Unit("-"), Field(ge=0.5, lt=1)]
    loss_slope: Number
    loss_curvature: Number
    loss_ceiling: Annotated[float, Unit("-"), Field(gt=0, lt=1)]
    hydrocarbon_share: Annotated[float, Unit("-"), Field(ge=0, le=1)]
    pressure_loss: Fraction
    hydrogen_to_carbon: Annotated[float, Unit("-"), Field(ge=0, le=4)]

    @property
    def co2_per_fuel(self) -> float:
        """CO2 of complete combustion [kg per kg of fuel]: carbon balance of CHx."""
        return 44.009 / (12.011 + 1.008 * self.hydrogen_to_carbon)


class GasGeneratorTurbineData(Record):
    """Gas-generator turbine and its shaft."""

    efficiency: Efficiency
    speed_curvature: Number
    flow_exponent: Positive
    cooling_fraction: Fraction
    mechanical_efficiency: Efficiency
    accessory_power: Watt


class PowerTurbineData(Record):
    """Power (free) turbine; its design efficiency follows from the design point.

    ``best_velocity_ratio``: blade speed over spouting velocity of the highest efficiency, over the design point's.
    """

    speed_curvature: Number
    best_velocity_ratio: Annotated[float, Unit("-"), Field(ge=0.8, le=1.3)]
    flow_exponent: Positive
    mechanical_efficiency: Efficiency
    duct_pressure_loss: Fraction


class ExhaustData(Record):
    """Exhaust: total-pressure loss of the design point."""

    pressure_loss: Fraction


class InstallationData(Record):
    """What an aircraft puts before and behind the engine of the test bed; all zero on the test bed.

    Acts off-design only: the design point is the bare engine's. Pressure losses are fractions of total pressure; the
    back pressure is the excess of the static pressure at the exhaust over ambient, as a fraction of it.
    """

    intake_pressure_loss: Fraction
    intake_temperature_rise: Annotated[float, Unit("K"), Field(ge=0, le=50)]
    exhaust_back_pressure: Fraction


TAKE_OFF = "take_off"  # the rating that is the engine's own limits
RatedPower = Annotated[float, Field(gt=0)]
TemperatureRatio = Annotated[float, Field(ge=0.7, le=1.3)]  # over the inter-turbine temperature of the design point
SpeedRatio = Annotated[float, Field(ge=0.3, le=1.3)]


class NamedRating(Record):
    """A rating below take-off: the engine gives the most power that every number of it allows, at least one of them.

    ``power_turbine_speed`` is where the rating is used, for a user who names no other.
    """

    power: Annotated[RatedPower | None, Unit("W")] = None
    inter_turbine_temperature_ratio: Annotated[TemperatureRatio | None, Unit("-")] = None
    gas_generator_speed: Annotated[SpeedRatio | None, Unit("-")] = None
    power_turbine_speed: Annotated[SpeedRatio | None, Unit("-")] = None

    @model_validator(mode="after")
    def _limits_something(self) -> NamedRating:
        if (self.power, self.inter_turbine_temperature_ratio, self.gas_generator_speed) == (None, None, None):
            raise ValueError("neither power, inter_turbine_temperature_ratio nor gas_generator_speed")
        return self

    @model_serializer(mode="wrap")
    def _given(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Without the numbers that the file does not give."""
        return {name: value for name, value in handler(self).items() if value is not None}


class RatingsData(Record):
    """Limits of the engine itself, which make its take-off rating, and other ratings by name."""

    take_off_power: Annotated[float, Unit("W"), Field(gt=0)]
    inter_turbine_temperature_ratio: Annotated[TemperatureRatio, Unit("-")]
    gas_generator_speed: Annotated[SpeedRatio, Unit("-")]
    idle_power_ratio: Annotated[float, Unit("-"), Field(ge=0, lt=0.5)]
    named: dict[str, NamedRating] = Field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all ratings."""
        return (TAKE_OFF, *self.named)


class CalibrationData(Record):
    """A part-power fuel flow of one engine at sea level, ISA, to calibrate on besides the design point."""

    power: Annotated[float, Unit("W"), Field(gt=0)]
    fuel_flow: Annotated[float, Unit("kg/h"), Field(gt=0)]
    true_airspeed: Annotated[float, Unit("m/s"), Field(ge=0)]


class EngineData(Record):
    """One turboshaft engine."""

    name: str
    sources: dict[str, str]
    design_point: DesignPointData
    intake: IntakeData
    compressor: CompressorData
    combustor: CombustorData
    reactors: ReactorData
    gas_generator_turbine: GasGeneratorTurbineData
    power_turbine: PowerTurbineData
    exhaust: ExhaustData
    installation: InstallationData
    ratings: RatingsData
    calibration: CalibrationData | None = None
    variants: dict[str, dict[str, dict[str, Any]]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _variants_apply(self) -> EngineData:
        for name in self.variants:
            self.variant(name)
        return self

    def changed(self, component: str, **values: float) -> EngineData:
        """A copy with other numbers in one ``component``; raises :class:`InputError` for an unknown one.

        ``values``: the numbers by the names of the component's fields [the units of the data file].
        """
        return self.model_copy(update={component: self._part(component).replaced(**values)})

    def variant(self, name: str) -> EngineData:
        """The engine with one named variant of the file: ``[variants.NAME.COMPONENT]`` replaces numbers of a component.

        Raises :class:`InputError` for an unknown name.
        """
        if name not in self.variants:
            known = ", ".join(self.variants) or "none"
            raise InputError(f"{self.name}: variant = {name!r}: expected one of: {known}")
        parts = {}
        for component, entries in self.variants[name].items():
            part = self._part(component)
            origins = {key: origin.model_dump(exclude_none=True) for key, origin in part.provenance.items()}
            raw: dict[str, Any] = {key: getattr(part, key) for key in type(part).model_fields if key != "provenance"}
            raw |= {key: {"value": getattr(part, key), **origin} for key, origin in origins.items()}
            parts[component] = validated(type(part), {**raw, **entries}, where=f"variants.{name}.{component}")
        return self.model_copy(update=parts)

    def _part(self, component: str) -> Record:
        part = getattr(self, component, None) if component in type(self).model_fields else None
        if not isinstance(part, Record):
            raise InputError(f"{self.name}: unknown component {component!r}")
        return part


def load_engine(path_or_name: str | Path = DEFAULT_ENGINE) -> EngineData:
    """The engine of a TOML file, or a shipped one: ``path_or_name`` is a path or, as "allison_250_c20b", a name.

    Raises :class:`InputError` with one line that names the file, the field, its value and what is allowed.
    """
    text = str(path_or_name)
    if text.endswith(".toml") or "/" in text or "\\" in text:
        path = Path(text)
        return validated(EngineData, read_toml(path), where=str(path))
    folder = resources.files("vrsopt") / "data"
    with resources.as_file(folder / f"{text}.toml") as path:
        if not path.is_file():
            raise InputError(f"engine = {text!r}: neither a shipped engine nor a path to a .toml file")
        data: dict[str, Any] = read_toml(path)
        if "design_point" not in data:
            raise InputError(f"engine = {text!r}: not an engine file")
    return validated(EngineData, data, where=f"{text}.toml")
