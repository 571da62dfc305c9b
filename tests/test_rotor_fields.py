"""Maps of the rotor: they are those of the trim, with units, and they close the circle."""

import math

import numpy as np
import pytest
import xarray as xr

import vrsopt
from vrsopt.aircraft import load_aircraft
from vrsopt.report.files import write_point
from vrsopt.report.rotor_plots import point_figures
from vrsopt.rotor_fields import UNITS, retreating_angle, rotor_map


@pytest.fixture(scope="module")
def point():
    return vrsopt.trim(2200.0, 55.0, method="newton")


@pytest.fixture(scope="module")
def fields(point):
    return rotor_map(point)


def test_units_and_closed_circle(fields):
    assert set(fields.data_vars) == set(UNITS)
    assert all(fields[name].attrs["units"] == unit for name, (unit, _) in UNITS.items())
    assert float(fields.azimuth[0]) == 0.0 and float(fields.azimuth[-1]) == 360.0
    for name in UNITS:
        values = fields[name].values
        assert np.all(np.isfinite(values))
        assert np.array_equal(values[:, 0], values[:, -1])


def test_lift_of_the_map_is_the_thrust(point, fields):
    rotor = load_aircraft().main_rotor
    points, weights = np.polynomial.legendre.leggauss(fields.sizes["radius"])
    dr = weights / 2 * (1 - rotor.root_cutout) * rotor.radius
    mean = fields["lift_n_m"].values[:, :-1].mean(axis=1)
    thrust = rotor.blades * float(dr @ mean)
    # the lift is normal to the deflected blade: the cosine of the slope is left out
    assert thrust == pytest.approx(point.solution.outputs["thrust"], rel=3e-3)


def test_mach_number_is_that_of_the_motion(point, fields):
    advancing = fields["mach"].isel(radius=-1).sel(azimuth=90.0)
    tip = float(fields.radius[-1])
    mu = point.advance_ratio
    assert float(advancing) == pytest.approx(point.advancing_tip_mach * (tip + mu) / (1 + mu), rel=5e-3)


def test_reversed_flow_is_on_the_retreating_side(fields):
    backwards = abs(fields["angle_of_attack_deg"]) > 90.0
    azimuths = np.broadcast_to(fields.azimuth.values, backwards.shape)[backwards.values]
    assert len(azimuths) > 0
    assert np.all((azimuths > 180.0) & (azimuths < 360.0))
    assert 0.0 < retreating_angle(fields) < math.radians(20.0)


@pytest.mark.slow
def test_no_map_without_a_trim():
    lost = vrsopt.trim(5000.0, 80.0, altitude=3000.0, method="newton")
    assert not lost.success
    with pytest.raises(vrsopt.InputError, match="no trim at this point"):
        rotor_map(lost)


def test_figures_and_files(point, tmp_path):
    assert set(point_figures(point)) == {"rotor_maps", "blade_motion", "powers_and_margins"}
    files = write_point(point, tmp_path / "deep" / "down")
    assert sorted(file.name for file in files) == [
        "blade_motion.png",
        "powers_and_margins.png",
        "rotor_map.nc",
        "rotor_maps.png",
    ]
    with xr.open_dataset(tmp_path / "deep" / "down" / "rotor_map.nc") as stored:
        assert stored["cl_m2"].dims == ("radius", "azimuth")


def test_powers_of_the_point_add_up(point):
    shaft = point.main_rotor_power + point.tail_rotor_power
    assert sum(point.powers.values()) == pytest.approx(shaft, rel=0.01)
