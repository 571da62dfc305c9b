"""What the aircraft is along any mission on one day, whatever its rotor power comes from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vrsopt import foca
from vrsopt.atmosphere import standard_air
from vrsopt.drive_train import engine_power
from vrsopt.limits import Limits
from vrsopt.surrogate.emission_table import EmissionTable, emission_table
from vrsopt.surrogate.engine_table import EngineTable

# By how much a schedule keeps off the limit of the tail rotor: the surrogate's error of its usage, measured in climbs
# of up to 10 deg at 40 m/s; of all other limits it is below 0.1 %
TAIL_MARGIN = 0.005


@dataclass(frozen=True)
class Plant:
    """What the aircraft is along any mission on one day: limits, engine table, inertia, box of the surrogate.

    ``polar_inertia`` [kg m2]: zero leaves the rotor's kinetic energy out. Sampled box: ``highest_altitude`` [m],
    ``lower`` and ``upper`` (3,) of mass [kg], rotor speed [rad/s] and twist [rad].
    """

    limits: Limits
    table: EngineTable
    isa_offset: float
    polar_inertia: float
    highest_altitude: float
    lower: np.ndarray
    upper: np.ndarray

    def mach(self, speed: Any, altitude: Any) -> Any:
        """Mach number at true airspeed [m/s] and pressure altitude [m]."""
        return speed / standard_air(altitude, self.isa_offset).speed_of_sound

    def engine_power(self, rotor_power: Any, Omega: Any, rate: Any) -> Any:
        """Power of one engine [W], with the power J Omega dOmega/dt that speeds up the rotor."""
        kinetic = self.polar_inertia * Omega * rate
        return engine_power(self.limits.aircraft, self.limits.engine, rotor_power + kinetic)

    def usages(
        self, weight: Any, Omega: Any, *, speed: Any, density: Any, power: Any, temperature: Any, tail_loading: Any
    ) -> tuple[Any, ...]:
        """Usage of each limit, in the order of LIMIT_NAMES; that of the tail rotor with its margin."""
        flown = {"speed": speed, "density": density, "power": power, "temperature": temperature}
        *others, tail = self.limits.usages(weight, Omega, tail_loading=tail_loading, **flown).values()
        return (*others, tail + TAIL_MARGIN)

    @property
    def emission_table(self) -> EmissionTable:
        """Made at the first call in a process, which takes some seconds: a search for a schedule does not need it.

        Raises :class:`NoSolutionError` where gas path or combustor can not be solved.
        """
        made = emission_table(engine_data=self.limits.engine, isa_offset=self.isa_offset)
        return replace(made, engine=self.table)

    def emissions(
        self, altitude: Any, mach: Any, node: Any, *, fuel_flow: Any, power: Any, rotor_speed: Any
    ) -> dict[str, np.ndarray]:
        """Emissions of all engines [kg/s] by name at nodes ``node`` (N,) among the conditions ``altitude`` [m] and
        ``mach`` (n,); fuel flow of all engines [kg/s], power of one [W] and rotor speed [rad/s] are (N, k).

        Raises what :attr:`emission_table` raises.
        """
        table = self.emission_table
        generator, indices = (series[node] for series in table.contract(altitude, mach))
        ratio = rotor_speed / self.limits.aircraft.main_rotor.nominal_rotor_speed
        # the flow of an index is proportional to the fuel, so that all engines' fuel gives all engines' emissions
        flows = table.evaluate((generator, indices), fuel_flow, power, ratio)
        return flows | {"foca_nox": fuel_flow * foca.nox_index(power), "foca_co": fuel_flow * foca.co_index(power)}
