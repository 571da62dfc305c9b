"""Aircraft data: typed, validated, every number with unit and source; read from TOML."""

from __future__ import annotations

import hashlib
import json
from functools import lru_cache
from math import pi, radians
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, PrivateAttr, model_validator

from vrsopt.airframe_data import Degrees, Fuselage, Loading, Metres, Ratio, SquareMetres, Surface
from vrsopt.errors import InputError
from vrsopt.quantity import Record, Unit, check_increasing, read_toml, validated
from vrsopt.rotor.airfoil import Airfoil

DATA = Path(__file__).parent / "data"
SAME_LENGTH = 1e-6  # relative difference of two numbers for one length
SAME_INERTIA = 0.1  # of two sources for one blade

Stations = Annotated[tuple[float, ...], Metres, Field(min_length=2)]


class Blade(Record):
    """Structure of a main-rotor blade at radial stations, linear between them; clamped at the first station.

    Polar inertia is per length, about the pitch axis. Centres of mass and of aerodynamic force lie so far ahead of the
    pitch axis (towards the leading edge). Structural damping is a fraction of critical at the nominal frequency.
    """

    station: Stations
    mass_per_length: Annotated[tuple[float, ...], Unit("kg/m")]
    bending_stiffness_flap: Annotated[tuple[float, ...], Unit("N m2")]
    bending_stiffness_lag: Annotated[tuple[float, ...], Unit("N m2")]
    torsional_stiffness: Annotated[tuple[float, ...], Unit("N m2")]
    polar_inertia: Annotated[tuple[float, ...], Unit("kg m")]
    mass_centre_offset: Annotated[float, Metres, Field(gt=-0.2, lt=0.2)]
    aerodynamic_centre_offset: Annotated[float, Metres, Field(gt=-0.2, lt=0.2)]
    structural_damping: Annotated[float, Ratio, Field(ge=0, le=0.1)]
    structural_damping_lag: Annotated[float, Ratio, Field(ge=0, le=0.1)]

    @model_validator(mode="after")
    def _shapes(self) -> Blade:
        for name in (
            "mass_per_length",
            "bending_stiffness_flap",
            "bending_stiffness_lag",
            "torsional_stiffness",
            "polar_inertia",
        ):
            values = getattr(self, name)
            if len(values) != len(self.station):
                raise ValueError(f"{name}: {len(values)} values: expected one for each of {len(self.station)} stations")
            if min(values) <= 0:
                raise ValueError(f"{name}: {min(values)}: must be positive")
        check_increasing("station", self.station)
        return self

    @property
    def flap_inertia(self) -> float:
        """Second moment of the blade's mass about the centre of the rotor [kg m2]; exact, by Simpson's rule."""

        def segment(r_1: float, r_2: float, m_1: float, m_2: float) -> float:
            return (r_2 - r_1) / 6 * (m_1 * r_1**2 + (m_1 + m_2) * (r_1 + r_2) ** 2 / 2 + m_2 * r_2**2)

        r, m = self.station, self.mass_per_length
        return sum(segment(*ends) for ends in zip(r[:-1], r[1:], m[:-1], m[1:], strict=True))


class MainRotor(Record):
    """Main rotor, counter-clockwise seen from above."""

    blades: Annotated[int, Ratio, Field(ge=2, le=8)]
    radius: Annotated[float, Metres, Field(gt=1, lt=20)]
    chord: Annotated[float, Metres, Field(gt=0.05, lt=2)]
    nominal_rotor_speed: Annotated[float, Unit("rad/s"), Field(gt=5, lt=150)]
    built_in_twist: Annotated[float, Degrees, Field(ge=-25, le=5)]
    root_cutout: Annotated[float, Ratio, Field(ge=0, lt=0.5)]
    precone: Annotated[float, Degrees, Field(ge=-2, le=8)]
    shaft_tilt_forward: Annotated[float, Degrees, Field(ge=-5, le=10)]
    hub_height: Annotated[float, Metres, Field(gt=0, lt=5)]
    hub_aft_of_cg: Annotated[float, Metres, Field(gt=-1, lt=1)]
    hub_above_skids: Annotated[float, Metres, Field(gt=1, lt=8)]
    flap_inertia: Annotated[float, Unit("kg m2"), Field(gt=1, lt=10000)]
    section_drag_level: Annotated[float, Ratio, Field(gt=0.004, lt=0.03)]
    induced_power_factor: Annotated[float, Ratio, Field(ge=1, le=1.5)]
    download_fraction: Annotated[float, Ratio, Field(ge=0, lt=0.2)]
    drive_train_inertia_fraction: Annotated[float, Ratio, Field(ge=0, lt=1)]
    blade: Blade
    section: Airfoil

    @model_validator(mode="after")
    def _blade_fits(self) -> MainRotor:
        station, radius, inner = self.blade.station, self.radius, self.root_cutout * self.radius
        if abs(station[-1] - radius) > SAME_LENGTH * radius:
            raise ValueError(f"blade.station = {list(station)}: must end at the radius, {radius:g} m")
        if station[0] > inner * (1 + SAME_LENGTH):
            raise ValueError(f"blade.station = {list(station)}: must begin inboard of root_cutout, {inner:g} m")
        return self

    @property
    def twist(self) -> float:
        """Nominal blade twist [rad], washout positive: the source counts the tip's pitch against the root's."""
        return radians(-self.built_in_twist)

    @property
    def blade_area(self) -> float:
        """Area of all blades [m2], extended to the centre."""
        return self.blades * self.chord * self.radius

    @property
    def solidity(self) -> float:
        """Blade area over disc area."""
        return self.blade_area / (pi * self.radius**2)

    @property
    def polar_inertia(self) -> float:
        """Polar inertia [kg m2] of the rotor with tail rotor and drive train, referred to the main-rotor shaft."""
        return self.blades * self.flap_inertia * (1 + self.drive_train_inertia_fraction)


class TailRotor(Record):
    """Teetering tail rotor, pushing to the right."""

    blades: Annotated[int, Ratio, Field(ge=2, le=8)]
    radius: Annotated[float, Metres, Field(gt=0.3, lt=5)]
    chord: Annotated[float, Metres, Field(gt=0.02, lt=1)]
    speed_ratio: Annotated[float, Ratio, Field(gt=1, lt=15)]
    root_cutout: Annotated[float, Ratio, Field(ge=0, lt=0.6)]
    built_in_twist: Annotated[float, Degrees, Field(ge=-20, le=20)]
    delta3: Annotated[float, Degrees, Field(ge=-60, le=60)]
    behind_cg: Annotated[float, Metres, Field(gt=1, lt=20)]
    above_cg: Annotated[float, Metres, Field(gt=-2, lt=5)]
    induced_power_factor: Annotated[float, Ratio, Field(ge=1, le=1.5)]
    fin_blockage: Annotated[float, Ratio, Field(gt=0.5, le=1)]

    @property
    def twist(self) -> float:
        """Blade twist [rad], washout positive."""
        return radians(-self.built_in_twist)

    @property
    def blade_area(self) -> float:
        """Area of all blades [m2], extended to the centre."""
        return self.blades * self.chord * self.radius


class Transmission(Record):
    """Drive train between engines and rotors, and its limits."""

    engines: Annotated[int, Ratio, Field(ge=1, le=3)]
    efficiency: Annotated[float, Ratio, Field(gt=0.8, le=1)]
    accessory_power: Annotated[float, Unit("kW"), Field(ge=0, lt=100)]
    rated_power_per_engine: Annotated[float, Unit("kW"), Field(gt=10, lt=5000)]
    one_engine_inoperative_power: Annotated[float, Unit("kW"), Field(gt=10, lt=5000)]

    def power_per_engine(self, rotor_power: Any) -> Any:
        """Shaft power of one engine [W] for the power of main and tail rotor [W]."""
        return (rotor_power / self.efficiency + 1e3 * self.accessory_power) / self.engines


class BladeLoadingLimit(Record):
    """Largest thrust coefficient over solidity against advance ratio, the part of it that the tail rotor may use, and
    the margin that a schedule keeps with the main rotor."""

    advance_ratio: Annotated[tuple[float, ...], Ratio, Field(min_length=2)]
    thrust_over_solidity: Annotated[tuple[float, ...], Ratio, Field(min_length=2)]
    tail_rotor_fraction: Annotated[float, Ratio, Field(ge=0.5, le=1)]
    manoeuvre_margin: Annotated[float, Ratio, Field(ge=1, le=2)]

    @model_validator(mode="after")
    def _shapes(self) -> BladeLoadingLimit:
        if len(self.advance_ratio) != len(self.thrust_over_solidity):
            raise ValueError("thrust_over_solidity: expected one value for each advance ratio")
        check_increasing("advance_ratio", self.advance_ratio)
        if min(self.thrust_over_solidity) <= 0:
            raise ValueError(f"thrust_over_solidity: {min(self.thrust_over_solidity)}: must be positive")
        return self


class CalibratedVariant(Record):
    """One way to meet the calibration points: the constants that were solved, the others at their sourced values."""

    induced_power_factor: Annotated[float, Ratio, Field(gt=0.5, lt=2)]
    section_drag_level: Annotated[float, Ratio, Field(gt=0.002, lt=0.03)]
    parasite_area: Annotated[float, SquareMetres, Field(gt=0.1, lt=5)]


class Aircraft(Record):
    """A helicopter: everything the rotor, the airframe and the drive train are described by."""

    name: str
    engine: str
    sources: dict[str, str]
    main_rotor: MainRotor
    tail_rotor: TailRotor
    tailplane: Surface
    fin: Surface
    fuselage: Fuselage
    loading: Loading
    transmission: Transmission
    blade_loading_limit: BladeLoadingLimit
    variants: dict[str, CalibratedVariant] = Field(default_factory=dict)

    _hash: int | None = PrivateAttr(default=None)

    @model_validator(mode="after")
    def _one_inertia(self) -> Aircraft:
        given, beam = self.main_rotor.flap_inertia, self.main_rotor.blade.flap_inertia
        if abs(given - beam) > SAME_INERTIA * beam:
            allowed = f"within {100 * SAME_INERTIA:g} % of {beam:.1f} kg m2, which main_rotor.blade integrates to"
            raise ValueError(f"main_rotor.flap_inertia = {given:g}: {allowed}")
        return self

    def __hash__(self) -> int:
        if self._hash is None:
            self._hash = hash(self.model_dump_json())
        return self._hash

    def variant(self, name: str) -> Aircraft:
        """This aircraft with the other set of calibrated constants called ``name``."""
        if name not in self.variants:
            raise InputError(f"{self.name}: variant = {name!r}: one of {', '.join(sorted(self.variants)) or 'none'}")
        other = self.variants[name]
        rotor = self.main_rotor.replaced(
            induced_power_factor=other.induced_power_factor, section_drag_level=other.section_drag_level
        )
        fuselage = self.fuselage.replaced(parasite_area=other.parasite_area)
        return self.replaced(main_rotor=rotor, fuselage=fuselage)


def load_aircraft(name: str | Path = "bo105") -> Aircraft:
    """The aircraft called ``name`` (shipped with the package) or described in the TOML file of that path.

    Raises :class:`InputError` with one line that names file and field when the data is missing, unknown or impossible.
    """
    if not isinstance(name, str | Path):
        raise InputError(f"aircraft = {name!r}: a name, a path to a .toml file, or aircraft data")
    path = data_path(name)
    if not path.exists() and path.suffix != ".toml":
        raise InputError(f"aircraft = {str(name)!r}: a shipped aircraft (bo105, uh60a) or a path to a .toml file")
    changed = path.stat().st_mtime_ns if path.is_file() else 0
    return _load_aircraft(path.resolve(), changed)


@lru_cache(maxsize=16)
def _load_aircraft(path: Path, changed: int) -> Aircraft:
    return validated(Aircraft, read_toml(path), where=path.name)


def data_path(name: str | Path) -> Path:
    """Path of a shipped data file given by its bare name, or of the user's own file."""
    shipped = DATA / f"{name}.toml"
    return shipped if shipped.is_file() else Path(name)


def data_hash(*records: Record) -> str:
    """Short hash of the numbers in records of data, to tell which data a result was made with.

    Sources, notes, named variants and calibration points do not count.
    """
    silent = {"provenance", "sources", "variants", "calibration"}

    def numbers(content: Any) -> Any:
        if isinstance(content, dict):
            return {key: numbers(value) for key, value in content.items() if key not in silent}
        return content

    text = json.dumps([numbers(record.model_dump(mode="json")) for record in records], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]
