"""The generic engine of the 500 kW class: its design point, its class, and the whole chain with it."""

import numpy as np
import pytest

import vrsopt
from vrsopt import foca
from vrsopt.aircraft import load_aircraft
from vrsopt.helicopter import Helicopter
from vrsopt.limits import Limits
from vrsopt.surrogate.engine_table import engine_table
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.cycle import sized
from vrsopt.turboshaft.data import load_engine
from vrsopt.turboshaft.performance import engine

GENERIC = load_engine("generic_500kw")


def test_design_point():
    result = vrsopt.engine(500e3, engine_data=GENERIC)
    assert result.success and result.sfc_kg_kwh == pytest.approx(0.345, rel=1e-6)
    assert result.pressure_ratio == pytest.approx(9.0, rel=1e-6)
    assert result.air_flow_kg_s == pytest.approx(2.3, rel=1e-6)
    design = sized(GENERIC)
    assert 1250.0 < design.t4 < 1450.0 and 0.79 < design.power_turbine_efficiency < 0.86


def test_part_power_is_that_of_its_class():
    # FOCA (2015), engines of 600 to 1000 shp: a fleet average
    power = np.linspace(0.2, 1.0, 20) * 500e3
    points = np.zeros((20, 8))
    points[:, 0], points[:, 1] = power, 1.0
    ratio = solve_many(points, engine_data=GENERIC).outputs["fuel_flow"] / foca.fuel_flow(power, rating=500e3)
    assert np.all((ratio > 0.85) & (ratio < 1.05))


def test_the_combustor_is_that_of_the_smaller_engine_scaled_with_its_air():
    small = load_engine()
    scale = GENERIC.design_point.air_flow / small.design_point.air_flow
    for name in type(small.reactors).model_fields:
        if name != "provenance":
            factor = scale if name.endswith("volume") else 1.0
            assert getattr(GENERIC.reactors, name) == pytest.approx(factor * getattr(small.reactors, name), rel=0.01)


def test_an_aircraft_flies_with_it():
    aircraft = load_aircraft("bo105").model_copy(update={"engine": "generic_500kw"})
    machine = Helicopter(aircraft)
    flight = {"mass": 2200.0, "altitude": 0.0, "speed": 30.0, "rotor_speed": 44.4, "twist": 0.13963}
    flight |= {"climb_angle": 0.0, "load_factor": 1.0, "isa_offset": 0.0}
    point = machine.point(flight, limits=Limits(aircraft, machine.engine))
    assert point.success and machine.engine.name == "generic 500 kW"
    alone = vrsopt.engine(point.shaft_power_per_engine, mach=30.0 / 340.294, engine_data=GENERIC)
    assert point.fuel_flow == pytest.approx(2 * alone.fuel_flow_kg_s, rel=1e-6)
    assert max(engine_table(engine_data=GENERIC).error) < 1e-6


def test_one_fit_of_the_combustor_has_no_range():
    assert "over the combustor's fits" in str(engine(200e3))
    assert "over the combustor's fits" not in str(engine(200e3, engine_data=GENERIC))
