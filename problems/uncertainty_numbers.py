"""What the study of uncertainty varies: every number of the data files that has a range, and four of the study's own.

Ranges are read from the files. What plays no part in the fuel of steady flight is left out, with the reason beside it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from calibrate_rotor import calibrate

from vrsopt.aircraft import Aircraft, load_aircraft
from vrsopt.quantity import Record
from vrsopt.rotor.airfoil import Airfoil, with_largest_lift
from vrsopt.turboshaft.data import EngineData, load_engine

LEFT_OUT = {
    "main_rotor.induced_power_factor": "solved again on the calibration points",
    "fuselage.parasite_area": "solved again on the calibration points",
    "main_rotor.drive_train_inertia_fraction": "kinetic energy of the rotor: no part in steady flight",
    "loading.": "centre of gravity and inertia: the missions fly at the reference, turns change powers by under 0.01 %",
    "engine.reactors.": "emissions alone",
    "engine.combustor.hydrocarbon_share": "emissions alone",
    "engine.compressor.surge_coordinate": "a warning alone",
    "engine.compressor.choke_coordinate": "a warning alone",
    "engine.compressor.slowest_line": "a warning alone",
    "engine.compressor.fastest_line": "a warning alone",
    "engine.ratings.": "a rating that the missions do not use",
    "engine.calibration.": "a chart reading that the shipped engine does not meet",
}
LEVEL = "blade_loading_limit.thrust_over_solidity"  # a table: varied as a whole
UNCALIBRATED = ("engine.", "blade_loading_limit.", "flight.")  # what the rotor's two calibration points do not feel
SPLIT = "induced factor"
MACH = 0.3  # at which the level of the section's drag is given
DRAG = (
    *("drag_level", "drag_parabola", "drag_bucket_sine", "ramp_sine", "ramp_slope", "log_ramp_width"),
    *("negative_ramp_sine", "negative_ramp_slope", "log_negative_ramp_width"),
)

# No source gives ranges of these; they are assumptions of this study. The constants of NACA 0012 have 3 to 17 % less
# largest lift than the shipped section at Mach 0.3 to 0.5, and 1.4 times its growth of drag with lift at 0.3 to 0.4.
OWN_RANGES = {
    "section.largest_lift": (0.85, 1.10),
    "section.drag_growth": (0.75, 1.50),
    "section.drag_rise_mach": (0.97, 1.03),
    "flight.gross_mass": (0.95, 1.05),
}


@dataclass(frozen=True)
class Number:
    """One number that is varied: its path in the data, its shipped value, and both ends of its range.

    Tables and numbers of this study are factors: their shipped value is 1.
    """

    path: str
    value: float
    low: float
    high: float
    source: str

    @property
    def ends(self) -> tuple[float, float]:
        return self.low, self.high

    def at(self, unit: float) -> float:
        """The value at a place (0 to 1) of the range."""
        return self.low + unit * (self.high - self.low)


@dataclass(frozen=True)
class Case:
    """What is flown: aircraft, engine, and gross mass over that of the reference."""

    aircraft: Aircraft
    engine: EngineData
    mass_factor: float = 1.0

    @classmethod
    def shipped(cls) -> Case:
        aircraft = load_aircraft()
        return cls(aircraft, load_engine(aircraft.engine))

    def variant(self, name: str) -> Case:
        """With a named variant of the aircraft's or the engine's file."""
        if name in self.aircraft.variants:
            return replace(self, aircraft=self.aircraft.variant(name))
        return replace(self, engine=self.engine.variant(name))

    def changed(self, values: Mapping[str, float]) -> Case:
        """With other ``values`` by path; calibrated again if that feels one of them."""
        case = self
        for path, value in values.items():
            case = case._with(path, value)
        return case.calibrated() if any(not path.startswith(UNCALIBRATED) for path in values) else case

    def calibrated(self) -> Case:
        """With induced-power factor and parasite area solved on hover and cruise power of the flight manual."""
        solved = calibrate(self.aircraft, SPLIT)
        aircraft = _replaced(self.aircraft, "main_rotor.induced_power_factor", solved["induced_power_factor"])
        return replace(self, aircraft=_replaced(aircraft, "fuselage.parasite_area", solved["parasite_area"]))

    def _with(self, path: str, value: float) -> Case:
        start, _, rest = path.partition(".")
        if path == "flight.gross_mass":
            return replace(self, mass_factor=value)
        if start == "engine":
            component, _, name = rest.partition(".")
            return replace(self, engine=self.engine.changed(component, **{name: value}))
        if start == "section":
            section = SECTIONS[rest](self.aircraft.main_rotor.section, value)
            return replace(self, aircraft=_replaced(self.aircraft, "main_rotor.section", section))
        if path == LEVEL:
            table = self.aircraft.blade_loading_limit.thrust_over_solidity
            return replace(self, aircraft=_replaced(self.aircraft, path, tuple(value * entry for entry in table)))
        return replace(self, aircraft=_replaced(self.aircraft, path, value))


def numbers() -> tuple[Number, ...]:
    """All numbers that are varied: those of the aircraft, of the engine, of this study."""
    case = Case.shipped()
    found = [*_ranged(case.aircraft, ""), *_ranged(case.engine, "engine.")]
    kept = [number for number in found if not any(number.path.startswith(path) for path in LEFT_OUT)]
    own = [Number(path, 1.0, low, high, "this study") for path, (low, high) in OWN_RANGES.items()]
    return (*kept, *own)


def variants() -> tuple[str, ...]:
    """Names of the variants in the data files that change the fuel."""
    case = Case.shipped()
    engines = (name for name, parts in case.engine.variants.items() if set(parts) != {"reactors"})
    return (*case.aircraft.variants, *engines)


def _ranged(record: Record, start: str) -> Iterator[Number]:
    """Numbers of a record, and of those in it, that have a range."""
    for name in type(record).model_fields:
        value, path = getattr(record, name), start + name
        origin = record.provenance.get(name)
        if isinstance(value, Record):
            yield from _ranged(value, f"{path}.")
        elif isinstance(value, dict) and name not in ("provenance", "variants", "sources"):
            for key, part in value.items():
                yield from _ranged(part, f"{path}.{key}.")
        elif origin is not None and origin.range is not None:
            low, high = origin.range
            if isinstance(value, tuple):
                yield Number(path, 1.0, low / min(value), high / max(value), origin.source)
            else:
                yield Number(path, value, low, high, origin.source)


def _replaced(record: Any, path: str, value: Any) -> Any:
    """The record with another value at a path of names."""
    name, _, rest = path.partition(".")
    return record.replaced(**{name: _replaced(getattr(record, name), rest, value) if rest else value})


def _drag_growth(section: Airfoil, factor: float) -> Airfoil:
    """The section whose drag grows ``factor`` times as fast with lift; its level at zero incidence stays."""
    return _levelled(section.replaced(drag_parabola=tuple(factor * entry for entry in section.drag_parabola)))


def _drag_rise_mach(section: Airfoil, factor: float) -> Airfoil:
    """The section whose drag is what it was at a Mach number smaller by ``factor``; its level stays."""
    pairs = {name: getattr(section, name) for name in DRAG}
    moved = {name: tuple(c / factor**k for k, c in enumerate(entries)) for name, entries in pairs.items()}
    return _levelled(section.replaced(**moved))


def _levelled(section: Airfoil) -> Airfoil:
    """The section with its own drag at Mach 0.3 and zero incidence as the reference of the level."""
    return section.replaced(drag_reference=float(section.drag(0.0, MACH, section.drag_reference)))


SECTIONS = {
    "largest_lift": with_largest_lift,
    "drag_growth": _drag_growth,
    "drag_rise_mach": _drag_rise_mach,
}
