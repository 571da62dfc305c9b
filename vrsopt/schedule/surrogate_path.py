"""The aircraft along a mission from its surrogate: Kriging of the rotor power, then the engine's own equations.

Along given nodes the flight condition is fixed, so the rotors' power shrinks to a Chebyshev polynomial in mass, rotor
speed and twist (:mod:`vrsopt.schedule.rotor_tables`), and the engine's table to one in power and speed. The optimal-
control problem, the pointwise search and the re-flight all use these same polynomials; a test holds them to the Kriging
itself. The rotors fly on a standard day similar to the day of the mission (:mod:`vrsopt.schedule.similarity`), the
engines on the day itself.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Literal, get_args

import numpy as np

from vrsopt.atmosphere import standard_air
from vrsopt.errors import InputError
from vrsopt.flat_pitch import flat_pitch_power
from vrsopt.limits import Limits
from vrsopt.mission.conditions import FASTEST_SINKING, Conditions
from vrsopt.schedule.ground_idle import ground_idle
from vrsopt.schedule.plant import Plant
from vrsopt.schedule.rotor_tables import POWER_DEGREES, TAIL_DEGREES, USED, Flight, RotorTables
from vrsopt.schedule.similarity import StandardDay, standard_day
from vrsopt.schedule.surrogate_nodes import FLYING, GROUND_IDLE, SurrogatePath
from vrsopt.surrogate.best_speed import BestSpeedTable
from vrsopt.surrogate.engine_table import engine_table
from vrsopt.surrogate.export import FREE
from vrsopt.surrogate.kriging import KrigingState
from vrsopt.surrogate.space import LEVEL
from vrsopt.surrogate.store import Surrogate

Transmission = Literal["fixed", "variable"]  # of the engine's power turbine to the rotor
LEAST_CORRELATION = 98.0  # per cent, leave-one-out: below it a surrogate is not fit to be optimised on


class SurrogateAircraft:
    """Makes the path models of one mission from a surrogate: call it with the conditions at the nodes."""

    def __init__(
        self,
        surrogate: Surrogate,
        limits: Limits,
        *,
        isa_offset: float = 0.0,
        kinetic_energy: bool = True,
        transmission: Transmission = "fixed",
        force: bool = False,
    ) -> None:
        """``kinetic_energy``: charge the power that speeds up the rotor to the engines, and credit it back.
        ``transmission``: "fixed", the power turbine turns with the rotor; "variable", at its own best speed.

        Raises :class:`InputError` for a surrogate of another space than level flight, without the outputs needed, or
        whose leave-one-out correlation is too low to be optimised on (unless ``force``).
        """
        if surrogate.space != LEVEL.name:
            raise InputError(f"surrogate: space = {surrogate.space}: missions fly on one of the space {LEVEL.name}")
        if transmission not in get_args(Transmission):
            raise InputError(f"surrogate: transmission = {transmission!r}: one of {', '.join(get_args(Transmission))}")
        for name in USED:
            if name not in surrogate.models:
                raise InputError(f"surrogate: {name}: missing")
            correlation = surrogate.accuracy[name].pearson_percent
            if correlation < LEAST_CORRELATION and not force:
                allowed = f"at least {LEAST_CORRELATION:g} % to be optimised on"
                raise InputError(f"surrogate: {name}: leave-one-out correlation {correlation:.2f} %: {allowed}")
        self.models = surrogate.models
        state: KrigingState = self.models["main_rotor_power"].state_
        columns = [state.names.index(name) for name in FREE]
        rotor = limits.aircraft.main_rotor
        table = engine_table(isa_offset=isa_offset, engine_data=limits.engine)
        self.plant = Plant(
            limits,
            table if transmission == "fixed" else BestSpeedTable.of(table),
            isa_offset,
            rotor.polar_inertia if kinetic_energy else 0.0,
            float(state.upper[state.names.index("altitude")]),
            state.lower[columns],
            state.upper[columns],
        )
        self.rotors = RotorTables(self.models, limits.aircraft, self.plant.lower, self.plant.upper)

    def __call__(self, conditions: Conditions) -> SurrogatePath:
        """The aircraft at the nodes of ``conditions``; raises :class:`InputError` where they leave the sampled box or
        sink into the vortex ring."""
        self._check_sinking(conditions)
        keys = [conditions.speed, conditions.altitude, conditions.equivalent_climb_angle, conditions.height]
        keys += [conditions.idle, conditions.ground_idle]
        table, index = np.unique(np.array(keys, dtype=float), axis=1, return_inverse=True)
        kinds = FLYING - (table[4] > 0) - (table[5] > 0)
        day = standard_day(table[1], self.plant.isa_offset, self.plant.highest_altitude)
        flight = np.stack([table[0], table[1], kinds, *np.where(kinds == FLYING, (day.speed, day.mass), 1.0)])
        power, tail, burned = self._tables(table, kinds, day)
        engine = self.plant.table.contract(table[1], self.plant.mach(table[0], table[1]))
        load_factor = np.asarray(conditions.load_factor, dtype=float)
        return SurrogatePath(self.plant, index.ravel(), load_factor, flight, power, tail, engine, burned)

    def _tables(
        self, table: np.ndarray, kinds: np.ndarray, day: StandardDay
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coefficients of the rotor power (n, ...) [W] and the tail-rotor loading (n, ...) at the n conditions of
        ``table`` (speed [m/s], altitude [m], equivalent climb angle [rad], height [m] and the two kinds of idle), and
        power [W] and fuel flow [kg/s] of one engine at ground idle (2, n), elsewhere 0."""
        plant, n, (speed, altitude, climb_angle, height) = self.plant, len(kinds), table[:4]
        power, tail = (np.zeros((n, *(d + 1 for d in degrees))) for degrees in (POWER_DEGREES, TAIL_DEGREES))
        burned = np.zeros((2, n))
        flying = kinds == FLYING
        if np.any(flying):
            there = StandardDay(*(getattr(day, one.name)[flying] for one in fields(day)))
            flight = Flight(there, speed[flying] * there.speed, climb_angle[flying], height[flying])
            power[flying], tail[flying] = self.rotors(flight)
            power[flying] *= there.power[:, None, None, None]
        for k in np.flatnonzero(~flying):
            place = {"altitude": float(altitude[k]), "isa_offset": plant.isa_offset}
            power[k, 0, 0, 0] = flat_pitch_power(plant.limits.aircraft, **place)
            if kinds[k] == GROUND_IDLE:
                outputs = ground_idle(plant.limits.engine, **place).outputs
                burned[:, k] = outputs["power"], outputs["fuel_flow"]
        return power, tail, burned

    def _check_sinking(self, conditions: Conditions) -> None:
        angle = np.asarray(conditions.equivalent_climb_angle, dtype=float)
        forward, sinking = conditions.speed * np.cos(angle), -conditions.speed * np.sin(angle)
        air = standard_air(np.asarray(conditions.altitude, dtype=float), self.plant.isa_offset)
        induced, idle = self.rotors.hover_velocity(air.density), np.asarray(conditions.idle, dtype=bool)
        bad = np.flatnonzero((sinking > FASTEST_SINKING * induced) & (forward < induced) & ~idle)
        if bad.size:
            k = bad[0]
            where = f"surrogate: segment {conditions.segment[k]} at {conditions.time[k]:.0f} s"
            sinks = f"sinks at {sinking[k]:.1f} m/s with {forward[k]:.1f} m/s ahead"
            allowed = f"at most {FASTEST_SINKING * induced[k]:.1f} m/s below {induced[k]:.1f} m/s: vortex ring"
            raise InputError(f"{where}: {sinks} (or slows down as hard): {allowed}")
