"""Maps of the flight envelope: what the optimum is against the nominal rotor, its files and the command line."""

import json

import numpy as np
import pytest
import xarray as xr

import vrsopt
from vrsopt.cli import main
from vrsopt.envelope_map import ACTIVE, VARIABLES
from vrsopt.helicopter import helicopter
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.mission.conditions import Conditions
from vrsopt.report.envelope_plots import envelope_figures
from vrsopt.schedule.surrogate_path import SurrogateAircraft

MASSES = (1600.0, 2400.0)


@pytest.fixture(scope="module")
def maps():
    return vrsopt.envelope(points=72, masses=MASSES).dataset


@pytest.mark.slow
def test_maps_are_what_the_surrogate_says_at_the_optimum(maps):
    assert maps.sizes == {"mass": 2, "altitude": 6, "speed": 6}
    assert [maps[name].attrs["units"] for name, _, _ in VARIABLES] == [unit for _, unit, _ in VARIABLES]
    flat = maps.stack(point=("mass", "altitude", "speed"))
    flat = flat.isel(point=np.flatnonzero(flat["feasible"].values))
    assert 0.8 * 72 < flat.sizes["point"] < 72
    machine = helicopter()
    make = SurrogateAircraft(vrsopt.load_surrogate("level"), Limits(machine.aircraft, machine.engine, "manual", 1.3))
    model = make(Conditions.level(flat["speed"].values, flat["altitude"].values))
    mass, rotor_speed = flat["mass"].values, 0.444 * flat["rotor_speed_percent"].values
    best = model.evaluate(mass, rotor_speed, np.radians(flat["twist_deg"].values))
    nominal = model.evaluate(mass, 44.4, np.radians(8.0))
    np.testing.assert_allclose(best.fuel_flow, flat["fuel_flow_kg_s"], rtol=1e-9)
    np.testing.assert_allclose(100 * (best.fuel_flow / nominal.fuel_flow - 1), flat["fuel_flow_delta_percent"])
    assert np.all(flat["fuel_flow_delta_percent"] < 0) and np.all(flat["nox_delta_percent"] < 0)
    assert best.limits.max() < 1e-8
    for bit, limit in enumerate(best.limits):
        np.testing.assert_array_equal(np.abs(limit) <= 1e-3, flat["active"].values >> bit & 1 == 1)
    slowest = flat["rotor_speed_percent"].values < 75.0001
    np.testing.assert_array_equal(slowest, flat["active"].values >> ACTIVE.index("lowest rotor speed") & 1 == 1)
    assert slowest.any() and not slowest.all()
    assert np.all(flat["band_low_percent"] <= flat["rotor_speed_percent"] + 1e-9)
    assert np.all(flat["band_high_percent"] >= flat["rotor_speed_percent"] - 1e-9)


@pytest.mark.slow
def test_infeasible_points_have_no_optimum_and_name_the_limit(maps):
    lost = maps["feasible"].values == 0
    assert np.all(np.isnan(maps["rotor_speed_percent"].values[lost]))
    assert np.all(maps["nearest_limit"].values[~lost] == -1)
    assert "torque" in {LIMIT_NAMES[k] for k in maps["nearest_limit"].values[lost]}
    assert np.all(maps["speed"].values[np.nonzero(lost)[2]] == 70.0)


@pytest.mark.slow
def test_a_margin_costs_fuel_and_one_variable_alone_saves_less(maps):
    options = {"points": 72, "masses": MASSES}
    wide = vrsopt.envelope(**options, manoeuvre_margin=1.0)
    both = maps["fuel_flow_delta_percent"].values
    assert np.nanmax(wide.dataset["fuel_flow_delta_percent"].values - both) < 1e-6
    assert wide.summary()["masses_kg"]["2400"]["mean_fuel_flow_delta_percent"] < np.nanmean(both[1]) - 0.5
    twist = vrsopt.envelope(**options, variables="twist")
    found = twist.dataset["rotor_speed_percent"].values
    np.testing.assert_allclose(found[np.isfinite(found)], 100.0)
    alone = twist.dataset["fuel_flow_delta_percent"].values
    assert np.nanmin(alone - both) > -1e-6 and np.nanmean(alone) > np.nanmean(both) + 2.0
    assert "band" not in envelope_figures(twist.dataset)
    assert str(twist).splitlines()[1].split()[0] == "1600" and twist.message in str(twist)


@pytest.mark.slow
def test_command_writes_maps_and_one_object(capsys, tmp_path):
    settings = ("--points", "8", "--masses", "1600,2400", "--variables", "twist", "--workers", "1")
    assert main(["envelope", *settings, "--out", str(tmp_path / "maps"), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["success"] and summary["points"] == 8 and summary["rotor_speed_percent_bounds"] == [100.0, 100.0]
    written = {path.name for path in (tmp_path / "maps").iterdir()}
    assert written == {"envelope.nc", "summary.json", "twist.png", "fuel_flow.png", "nox.png", "active.png"}
    with xr.open_dataset(tmp_path / "maps" / "envelope.nc", engine="scipy") as maps:
        assert maps.sizes == {"mass": 2, "altitude": 2, "speed": 2} and maps.attrs["free_variables"] == "twist"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--variables", "all"), "envelope: variables = 'all': one of both, speed, twist"),
        (("--points", "3"), "envelope: points = 3: from 4 at each of 3 masses to 10000000"),
        (("--masses", "2000;1600"), "envelope: masses = '2000;1600': numbers with commas between them"),
        (("--masses", "2000,1600"), "envelope: mass = [2000.0, 1600.0]: ascending, from 500 to 5000"),
        (("--rotor-speed-percent", "80"), "envelope: rotor_speed_percent = '80': 2 numbers with a comma"),
        (("--rotor-speed-percent", "102,110"), "'102,110': the least and the largest, with 100 between them"),
        (("--masses", "2000,nan"), "envelope: mass = [2000.0, nan]: ascending"),
        (("--workers", "0"), "envelope: workers = 0: at least 1"),
        (("--isa-offset", "500"), "envelope: isa_offset = 500: from -50 to 50"),
        (("--manoeuvre-margin", "0.9"), "envelope: manoeuvre_margin = 0.9: a number from 1 to 2"),
    ],
)
def test_bad_input_is_one_line(capsys, tmp_path, words, message):
    assert main(["envelope", "--out", str(tmp_path / "maps"), *words]) == 2
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1
    assert not (tmp_path / "maps").exists()


def test_masses_outside_the_surrogate_are_refused():
    with pytest.raises(vrsopt.InputError, match="mass = 2600 kg: sampled from 1400 to 2500"):
        vrsopt.envelope(points=8, masses=(2000.0, 2600.0))
