"""What a flown schedule relies on: the surrogate's inputs along it, its deviation there, and points that mend it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vrsopt.drive_train import engine_power
from vrsopt.helicopter import helicopter
from vrsopt.limits import Limits
from vrsopt.mission.file import mission_from
from vrsopt.mission.profile import Profile
from vrsopt.quantity import read_toml
from vrsopt.schedule.decision import decision_nodes
from vrsopt.schedule.nominal import nominal_schedule
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.reliance import reliance
from vrsopt.schedule.rotor_tables import USED
from vrsopt.schedule.similarity import standard_day
from vrsopt.schedule.study_input import loaded, schedule_settings
from vrsopt.schedule.surrogate_path import SurrogateAircraft
from vrsopt.surrogate.kriging import Kriging

SARM = Path(__file__).parents[2] / "problems" / "sarm.toml"
MACHINE = helicopter()
LIMITS = Limits(MACHINE.aircraft, MACHINE.engine)
HOT = 15.0  # K
MAIN = "main_rotor_power"


class Flown:
    """The nominal schedule of the rescue mission on a hot day, whatever surrogate it is then asked of."""

    def __init__(self):
        self.shipped = loaded(None, MACHINE.data_hash)
        mission = mission_from(read_toml(SARM) | {"isa_offset_k": HOT}, where="sarm")
        self.profile = Profile.of(mission)
        self.nodes = decision_nodes(self.profile, 60.0)
        self.grid = FlightGrid(self.profile, self.made(self.shipped), step=5.0)
        schedule = nominal_schedule(self.profile, schedule_settings(mission, MACHINE))
        self.flight = self.grid.fly(schedule, takeoff_mass=1900.0)

    def made(self, surrogate):
        return SurrogateAircraft(surrogate, LIMITS, isa_offset=HOT)

    def reliance(self, surrogate):
        return reliance(self.made(surrogate), self.nodes, self.grid, self.flight)

    def refitted(self, inputs):
        """The surrogate on other inputs (n, 5): outputs from the shipped one, its correlations kept."""
        models = {}
        for name in USED:
            state = self.shipped.models[name].state_
            box = {"names": state.names, "lower": state.lower, "upper": state.upper}
            model = Kriging(**box, theta=state.theta, nugget=state.nugget)
            models[name] = model.fit(inputs, state.predict(inputs))
        return replace(self.shipped, models=models, accuracy={name: self.shipped.accuracy[name] for name in USED})


@pytest.fixture(scope="module")
def flown():
    return Flown()


def test_points_are_what_the_surrogate_is_asked(flown):
    """The Krigings at these points give the power that was flown: on a hot day, turning and straight."""
    found = flown.reliance(flown.shipped)
    here = flown.profile.conditions(found.segment.values, found.time.values)
    chosen = np.flatnonzero((np.abs(here.equivalent_climb_angle) < 1e-9) & (here.height > 100.0))
    assert np.max(here.load_factor[chosen]) > 1.02 and len(chosen) > 20
    points = found.point.values[chosen]
    power = sum(flown.shipped.models[name].predict(points) for name in ("main_rotor_power", "tail_rotor_power"))
    day = standard_day(here.altitude[chosen], HOT, 2000.0)
    expected = engine_power(MACHINE.aircraft, MACHINE.engine, power * day.power)
    for node, value in zip(chosen, expected, strict=True):
        same = (flown.flight.segment == int(found.segment[node])) & (flown.flight.time == float(found.time[node]))
        assert flown.flight.power_per_engine[same] == pytest.approx(value, rel=5e-4)
    predicted = flown.shipped.models[MAIN].posterior
    variance = (found.std_percent.values[chosen] / 100.0 * power) ** 2
    rounding = 1e-12 * predicted.scale  # the rest of the process variance after a sum over all rows
    assert variance == pytest.approx(predicted.variance(points), rel=1e-9, abs=rounding)
    assert np.min(variance) > 1e4 * rounding


def test_shipped_data_are_good_enough(flown):
    found = flown.reliance(flown.shipped)
    assert found.attrs["poor_data"] == ""
    assert 0.0 < found.attrs["mean_std_percent"] < 0.1
    assert found.attrs["mean_std_percent"] < found.attrs["largest_std_percent"] < 1.0


def test_sparse_data_are_mended_where_the_schedule_relies_on_them(flown):
    inputs = flown.shipped.models[MAIN].state_.inputs[:60]
    before = flown.reliance(flown.refitted(inputs))
    assert before.attrs["poor_data"].startswith("relies on poor data: predicted standard deviation ")
    assert " % of the power over the flight" in before.attrs["poor_data"]
    more = np.vstack([inputs, before.weak_point.values])
    after = flown.reliance(flown.refitted(more))
    assert after.attrs["largest_std_percent"] < 0.25 * before.attrs["largest_std_percent"]

    def error(rows):
        model, point = flown.refitted(rows).models[MAIN], before.point.values
        return np.sqrt(np.mean((model.predict(point) / flown.shipped.models[MAIN].predict(point) - 1.0) ** 2))

    assert error(more) < 0.25 * error(inputs)


def test_a_flight_outside_the_sampled_speeds_is_far_from_data(flown):
    inputs = flown.shipped.models[MAIN].state_.inputs
    fast = inputs[inputs[:, 2] > 35.0][:300]
    assert "of the box from any data at " in flown.reliance(flown.refitted(fast)).attrs["poor_data"]
