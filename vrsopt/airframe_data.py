"""Data of tail surfaces, fuselage, weight and balance: the tables of an aircraft file around the rotors."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from vrsopt.quantity import Record, Unit, check_increasing

Metres = Unit("m")
SquareMetres = Unit("m2")
Kilograms = Unit("kg")
Ratio = Unit("-")
Degrees = Unit("deg")


class Surface(Record):
    """A tail surface: area, place behind and above the centre of gravity, incidence, lift and, at right angles to the
    flow, the normal force of a plate."""

    area: Annotated[float, SquareMetres, Field(gt=0, lt=20)]
    behind_cg: Annotated[float, Metres, Field(gt=0, lt=20)]
    above_cg: Annotated[float, Metres, Field(gt=-3, lt=5)]
    incidence: Annotated[float, Degrees, Field(ge=-20, le=20)]
    lift_slope: Annotated[float, Unit("1/rad"), Field(gt=0.5, lt=7)]
    largest_lift: Annotated[float, Ratio, Field(gt=0.3, lt=3)]
    plate_normal_force: Annotated[float, Ratio, Field(gt=0.5, lt=2.5)]
    downwash_factor: Annotated[float, Ratio, Field(ge=0, le=3)]


class AngleTable(Record):
    """A coefficient over the whole circle of an angle, linear between the entries."""

    angle: Annotated[tuple[float, ...], Degrees, Field(min_length=4)]
    coefficient: Annotated[tuple[float, ...], Ratio]

    @model_validator(mode="after")
    def _circle(self) -> AngleTable:
        if len(self.angle) != len(self.coefficient):
            raise ValueError("coefficient: expected one value for each angle")
        check_increasing("angle", self.angle)
        if self.angle[0] > -180 or self.angle[-1] < 180:
            raise ValueError(f"angle: {self.angle[0]:g} to {self.angle[-1]:g}: must cover -180 to 180")
        return self


class Fuselage(Record):
    """Fuselage without tail surfaces.

    At small angles forces and moments are polynomials in the angle of attack or sideslip (rad, constant term first) at
    ``reference_speed`` and sea-level density; at large ones tables of coefficients with the plan or the side area and
    the length. All about the centre of gravity of the data.
    """

    reference_speed: Annotated[float, Unit("m/s"), Field(gt=1, lt=100)]
    force_x: Annotated[tuple[float, ...], Unit("N")]
    force_y: Annotated[tuple[float, ...], Unit("N")]
    force_z: Annotated[tuple[float, ...], Unit("N")]
    moment_y: Annotated[tuple[float, ...], Unit("N m")]
    moment_z: Annotated[tuple[float, ...], Unit("N m")]
    plan_area: Annotated[float, SquareMetres, Field(gt=0.5, lt=100)]
    side_area: Annotated[float, SquareMetres, Field(gt=0.5, lt=100)]
    length: Annotated[float, Metres, Field(gt=1, lt=40)]
    far_x: AngleTable
    far_y: AngleTable
    far_z: AngleTable
    far_moment_y: AngleTable
    far_moment_z: AngleTable
    parasite_area: Annotated[float, SquareMetres, Field(gt=0.1, lt=10)]
    extra_drag_above_cg: Annotated[float, Metres, Field(gt=-3, lt=5)]


class Inertia(Record):
    """Moments of inertia about the body axes through the centre of gravity, and the product of the roll and yaw axes
    (the integral of x z dm)."""

    roll: Annotated[float, Unit("kg m2"), Field(gt=10)]
    pitch: Annotated[float, Unit("kg m2"), Field(gt=10)]
    yaw: Annotated[float, Unit("kg m2"), Field(gt=10)]
    product: Annotated[float, Unit("kg m2")]

    @property
    def matrix(self) -> tuple[tuple[float, float, float], ...]:
        """Inertia tensor in body axes [kg m2], rows."""
        return ((self.roll, 0.0, -self.product), (0.0, self.pitch, 0.0), (-self.product, 0.0, self.yaw))


class Station(Record):
    """A place for load; arms count aft from the datum of the flight manual."""

    arm: Annotated[float, Metres, Field(gt=-10, lt=30)]


class Tank(Record):
    """A fuel tank and the fuel it holds."""

    arm: Annotated[float, Metres, Field(gt=-10, lt=30)]
    capacity: Annotated[float, Kilograms, Field(gt=1, lt=10000)]


class CgLimits(Record):
    """Foremost and aftmost arm of the centre of gravity at gross masses, linear between them."""

    mass: Annotated[tuple[float, ...], Kilograms, Field(min_length=2)]
    foremost: Annotated[tuple[float, ...], Metres]
    aftmost: Annotated[tuple[float, ...], Metres]

    @model_validator(mode="after")
    def _shapes(self) -> CgLimits:
        if not len(self.mass) == len(self.foremost) == len(self.aftmost):
            raise ValueError("foremost, aftmost: expected one value for each mass")
        check_increasing("mass", self.mass)
        for mass, foremost, aftmost in zip(self.mass, self.foremost, self.aftmost, strict=True):
            if foremost >= aftmost:
                raise ValueError(f"foremost: {foremost} at {mass:g} kg: must be less than aftmost")
        return self


class Loading(Record):
    """Masses the aircraft may have, where its loads are, and its inertia.

    Tanks are filled in the order of the file. ``reference_cg_arm`` is where the centre of gravity lies from which the
    other tables count (``behind_cg``, ``above_cg``).
    """

    reference_mass: Annotated[float, Kilograms, Field(gt=100, lt=30000)]
    smallest_mass: Annotated[float, Kilograms, Field(gt=100, lt=30000)]
    largest_mass: Annotated[float, Kilograms, Field(gt=100, lt=30000)]
    fuel_capacity: Annotated[float, Kilograms, Field(gt=1, lt=10000)]
    empty_mass: Annotated[float, Kilograms, Field(gt=100, lt=30000)]
    empty_arm: Annotated[float, Metres, Field(gt=-10, lt=30)]
    pilot_mass: Annotated[float, Kilograms, Field(gt=30, lt=200)]
    reference_cg_arm: Annotated[float, Metres, Field(gt=-10, lt=30)]
    crew: Station
    payload: Annotated[dict[str, Station], Field(min_length=1)]
    tanks: Annotated[dict[str, Tank], Field(min_length=1)]
    cg_limits: CgLimits
    inertia: Inertia

    @model_validator(mode="after")
    def _tanks_hold_the_fuel(self) -> Loading:
        held = sum(tank.capacity for tank in self.tanks.values())
        if abs(held - self.fuel_capacity) > 0.5:
            raise ValueError(f"fuel_capacity: {self.fuel_capacity:g}: the tanks hold {held:g} kg")
        return self
