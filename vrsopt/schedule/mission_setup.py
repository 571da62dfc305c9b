"""A mission made ready to be scheduled: aircraft, surrogate along the mission, limits, take-off mass."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from vrsopt.helicopter import Helicopter, helicopter
from vrsopt.limits import Limits
from vrsopt.mission.conditions import Conditions
from vrsopt.mission.file import Mission
from vrsopt.mission.loading import TakeoffLoading
from vrsopt.mission.profile import Profile
from vrsopt.mission.track import FlownMission
from vrsopt.schedule.nominal import nominal_schedule
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import Schedule
from vrsopt.schedule.study_input import loaded, schedule_settings
from vrsopt.schedule.surrogate_path import SurrogateAircraft, Transmission
from vrsopt.schedule.takeoff import closed_loading, given_loading
from vrsopt.surrogate.store import Surrogate

RESERVE_SPEEDS = np.arange(15.0, 46.0)  # m/s, among which the best-endurance speed is found


class MissionSetup:
    """One mission with its aircraft on the surrogate; every way of scheduling it begins here.

    ``mission``, ``machine``, ``profile``, ``limits``, ``surrogate``, ``settings``; ``make``: the path model of given
    conditions; ``grid``: the fine grid on which schedules are flown; ``nominal``: its nominal schedule.
    """

    def __init__(
        self,
        mission: Mission | FlownMission,
        surrogate: Surrogate | Path | str | None = None,
        *,
        transmission: Transmission = "fixed",
        say: Callable[[str], None] = lambda text: None,
    ) -> None:
        """``surrogate``: default the shipped one. ``transmission``: "variable" lets the engines run at their own best
        speed. ``say`` is told what takes time.

        Raises :class:`InputError` for unusable input.
        """
        self.mission = mission
        self.machine: Helicopter = helicopter(mission.aircraft)
        self.profile = mission.profile if isinstance(mission, FlownMission) else Profile.of(mission)
        margin = mission.limits.manoeuvre_margin or self.machine.aircraft.blade_loading_limit.manoeuvre_margin
        self.limits = Limits(self.machine.aircraft, self.machine.engine, mission.limits.limits, margin)
        self.surrogate = loaded(surrogate, self.machine.data_hash)
        self.settings = schedule_settings(mission, self.machine)
        self.transmission: Transmission = transmission
        self.make = SurrogateAircraft(
            self.surrogate, self.limits, isa_offset=mission.isa_offset_k, transmission=transmission
        )
        say("surrogate along the mission")
        self.grid = FlightGrid(self.profile, self.make, settings=self.settings)
        self.nominal = nominal_schedule(self.profile, self.settings)

    @cached_property
    def loading(self) -> TakeoffLoading:
        """The loading with which every schedule takes off: that of the nominal one.

        Raises :class:`InputError` and :class:`NoSolutionError` as :meth:`close`.
        """
        return self.close(self.nominal)

    def close(self, schedule: Schedule) -> TakeoffLoading:
        """Take-off mass with which ``schedule`` lands with the reserve; that of a flown track is given.

        Raises :class:`NoSolutionError` where the aircraft would be too heavy or its tank too small, :class:`InputError`
        where its model does not hold.
        """
        aircraft = self.machine.aircraft.loading
        if isinstance(self.mission, FlownMission):
            mass = self.mission.takeoff_mass
            return given_loading(self.grid, schedule, takeoff_mass=mass, aircraft=aircraft)
        return closed_loading(
            self.grid,
            schedule,
            loading=self.mission.loading,
            aircraft=aircraft,
            endurance_flow=self._endurance_flow,
        )

    def _endurance_flow(self, landing_mass: float) -> float:
        """Fuel flow [kg/s] at the speed of best endurance, nominal rotor, where the mission ends.

        At the nearest mass for which the aircraft's model holds, where it does not: what is tried on the way.
        """
        model = self._reserve_model
        mass = np.clip(np.full(len(RESERVE_SPEEDS), landing_mass), *model.bounds["mass"])
        values = model.evaluate(mass, self.settings.nominal_rotor_speed, self.settings.nominal_twist)
        return float(np.min(values.fuel_flow))

    @cached_property
    def _reserve_model(self) -> Any:
        end = self.profile.conditions(len(self.profile.segments) - 1, self.profile.duration)
        return self.make(Conditions.level(RESERVE_SPEEDS, float(end.altitude)))
