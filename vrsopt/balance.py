"""Weight and balance: gross mass and centre of gravity from empty aircraft, crew, payload and fuel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite

import numpy as np

from vrsopt.aircraft import Aircraft
from vrsopt.airframe_data import Loading
from vrsopt.errors import InputError


@dataclass(frozen=True)
class Load:
    """One item of the loading: mass [kg] and arm aft of the flight manual's datum [m]."""

    name: str
    mass: float
    arm: float


@dataclass(frozen=True)
class Balance:
    """A loaded aircraft: gross mass [kg], centre of gravity as arm aft of the flight manual's datum [m] and the arms
    allowed at this mass.

    ``cg_shift`` [m] is how far the centre of gravity lies before the one that the aircraft data counts from.
    """

    loads: tuple[Load, ...]
    mass: float
    cg_arm: float
    foremost: float
    aftmost: float
    cg_shift: float

    def __str__(self) -> str:
        rows = [f"{'':<17}{'kg':>8}{'arm m':>9}"]
        rows += [f"{load.name:<17}{load.mass:>8.1f}{load.arm:>9.3f}" for load in self.loads]
        rows += [
            f"{'gross':<17}{self.mass:>8.1f}{self.cg_arm:>9.3f}",
            f"{'allowed':<17}{'':>8}{self.foremost:>9.3f} to {self.aftmost:.3f}",
            f"{'shift':<17}{'':>8}{self.cg_shift:>+9.3f} forward of the aircraft data's",
        ]
        return "\n".join(rows)


def balance(
    aircraft: Aircraft,
    *,
    payload: float | Mapping[str, float] = 0.0,
    fuel: float | None = None,
    crew: float | None = None,
) -> Balance:
    """Mass and centre of gravity of the aircraft with these loads [kg].

    payload: in the first of the aircraft's payload stations, or by the names of the stations. fuel: fills the tanks in
    their order; None is full tanks. crew: on the front seats; None is one pilot. Fuel burns: ask again with less of it.

    Raises :class:`InputError` for a load that is not possible, a gross mass outside the aircraft's limits and a
    centre of gravity outside the arms allowed at that mass.
    """
    loading = aircraft.loading
    loads = (
        Load("empty", loading.empty_mass, loading.empty_arm),
        Load("crew", _checked("crew", loading.pilot_mass if crew is None else crew), loading.crew.arm),
        *_payload(loading, payload),
        *_fuel(loading, loading.fuel_capacity if fuel is None else fuel),
    )
    mass = sum(load.mass for load in loads)
    if not loading.smallest_mass <= mass <= loading.largest_mass:
        allowed = f"{loading.smallest_mass:g} to {loading.largest_mass:g} kg"
        raise InputError(f"balance: gross mass = {mass:.1f} kg: {allowed}")
    cg_arm = sum(load.mass * load.arm for load in loads) / mass
    limits = loading.cg_limits
    if not limits.mass[0] <= mass <= limits.mass[-1]:
        raise InputError(
            f"balance: gross mass = {mass:.1f} kg: limits of the centre of gravity are known from "
            f"{limits.mass[0]:g} to {limits.mass[-1]:g} kg"
        )
    foremost = float(np.interp(mass, limits.mass, limits.foremost))
    aftmost = float(np.interp(mass, limits.mass, limits.aftmost))
    if not foremost <= cg_arm <= aftmost:
        raise InputError(
            f"balance: centre of gravity = {cg_arm:.3f} m aft of the datum: {foremost:.3f} to {aftmost:.3f} m "
            f"at {mass:.1f} kg"
        )
    return Balance(loads, mass, cg_arm, foremost, aftmost, loading.reference_cg_arm - cg_arm)


def _checked(name: str, mass: float) -> float:
    if not (isfinite(mass) and mass >= 0):
        raise InputError(f"balance: {name} = {mass:g}: a mass in kg, zero or more")
    return float(mass)


def _payload(loading: Loading, payload: float | Mapping[str, float]) -> list[Load]:
    stations = loading.payload
    given = payload if isinstance(payload, Mapping) else {next(iter(stations)): payload}
    for name in given:
        if name not in stations:
            raise InputError(f"balance: payload = {name!r}: one of {', '.join(stations)}")
    return [Load(name, _checked(f"payload {name}", mass), stations[name].arm) for name, mass in given.items()]


def _fuel(loading: Loading, fuel: float) -> list[Load]:
    if not 0 <= fuel <= loading.fuel_capacity:
        raise InputError(f"balance: fuel = {fuel:g}: 0 to {loading.fuel_capacity:g} kg")
    loads, left = [], float(fuel)
    for name, tank in loading.tanks.items():
        held = min(left, tank.capacity)
        loads.append(Load(f"{name} tank", held, tank.arm))
        left -= held
    return loads
