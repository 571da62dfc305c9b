"""Standard atmosphere against its table; temperature offset; CasADi and arrays."""

import casadi as ca
import numpy as np
import pytest

from vrsopt.atmosphere import density_altitude, standard_air


# ICAO Doc 7488: altitude, temperature, pressure, density, speed of sound
@pytest.mark.parametrize(
    "altitude, temperature, pressure, density, sound",
    [
        (0.0, 288.15, 101325.0, 1.22500, 340.294),
        (1000.0, 281.65, 89874.6, 1.11164, 336.434),
        (2000.0, 275.15, 79495.2, 1.00649, 332.529),
        (5000.0, 255.65, 54019.9, 0.736116, 320.529),
    ],
)
def test_table(altitude, temperature, pressure, density, sound):
    air = standard_air(altitude)
    assert air.temperature == pytest.approx(temperature)
    assert air.pressure == pytest.approx(pressure, rel=2e-6)
    assert air.density == pytest.approx(density, rel=1e-5)
    assert air.speed_of_sound == pytest.approx(sound, rel=5e-6)


def test_a_warm_day_changes_temperature_and_density_only():
    standard, warm = standard_air(1500.0), standard_air(1500.0, 20.0)
    assert warm.pressure == standard.pressure
    assert warm.temperature == standard.temperature + 20.0
    assert warm.density == pytest.approx(standard.density * standard.temperature / warm.temperature)


def test_density_altitude_has_that_density():
    for altitude, offset in ((0.0, 20.0), (1219.2, 2.9), (2000.0, -15.0)):
        equivalent = density_altitude(altitude, offset)
        assert standard_air(equivalent).density == pytest.approx(standard_air(altitude, offset).density, rel=1e-12)
    assert density_altitude(1500.0, 0.0) == pytest.approx(1500.0, abs=1e-6)
    assert density_altitude(0.0, 15.0) > 0


def test_arrays_and_expressions():
    altitude = np.array([0.0, 1000.0, 2000.0])
    assert standard_air(altitude).density[1] == standard_air(1000.0).density
    h = ca.SX.sym("h")
    slope = ca.Function("slope", [h], [ca.gradient(standard_air(h, 5.0).density, h)])
    difference = (standard_air(1001.0, 5.0).density - standard_air(999.0, 5.0).density) / 2
    assert float(slope(1000.0)) == pytest.approx(difference, rel=1e-6)
