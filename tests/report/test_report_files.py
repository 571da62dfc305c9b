"""The files of a result: complete, strict, readable without this package, and never half written."""

import base64
import json
import os
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import trapezoid

from vrsopt.errors import InputError
from vrsopt.mission.track import FlownMission
from vrsopt.report.files import read_result, write_results

NAMES = ("flight_path", "mission_profile", "schedules", "fuel", "emissions", "phases", "saving")
ON_PAGE = ("fuel", "saving", "flight_path", "mission_profile", "schedules", "emissions", "phases")  # in that order
DATA = ("result.nc", "flight_path.geojson", "flight_path.kml")
FIGURES = [f"{name}.png" for name in NAMES]


def strict(text):
    """JSON without the NaN and Infinity that Python would let through."""

    def refuse(word):
        raise AssertionError(f"{word} is not JSON")

    return json.loads(text, parse_constant=refuse)


@pytest.fixture(scope="module")
def folder(with_variant, mission_text, tmp_path_factory):
    folder = tmp_path_factory.mktemp("results") / "deep" / "hop"
    paths = write_results(with_variant, folder, mission_text=mission_text)
    assert all(path.is_file() for path in paths)
    assert sorted(paths) == sorted(path for path in folder.rglob("*") if path.is_file())
    return folder


@pytest.fixture
def without_figures(monkeypatch):
    """For tests of other things: drawing takes a second."""
    monkeypatch.setattr("vrsopt.report.files.figures", lambda comparison: {})


def test_all_files_are_there_and_nothing_else(folder):
    names = sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())
    variant = [f"twist_only/{name}" for name in (*FIGURES, *DATA)]
    assert names == sorted([*FIGURES, *DATA, "report.html", "summary.json", *variant])


def test_points_that_would_help_are_a_table(broken, without_figures, mission_text, tmp_path):
    points = np.array([[2000.0, 300.0, 0.1 + 0.2, 40.0, 0.18], [1900.0, 0.0, 40.0, 41.0, 0.2]])
    names = ["mass", "altitude", "speed", "rotor_speed", "twist"]
    attributes = {"largest_std_percent": 6.0, "mean_std_percent": 0.1, "poor_data": ""}
    reliance = xr.Dataset({"weak_point": (("weak", "input"), points)}, {"input": names}, attributes)
    results = {name: replace(one, reliance=reliance) for name, one in broken.results.items()}
    write_results(replace(broken, results=results), tmp_path, mission_text=mission_text)
    table = np.genfromtxt(tmp_path / "weak_points.csv", delimiter=",", names=True)
    assert list(table.dtype.names) == names
    np.testing.assert_array_equal(np.stack([table[name] for name in names], axis=1), points)


def test_summary_is_strict_json_with_the_variants(folder, with_variant):
    summary = strict((folder / "summary.json").read_text(encoding="utf-8"))
    assert summary == with_variant.summary()
    assert summary["twist_only"]["schedules"]["trajectory"]["fuel_kg"] > 0.0


def test_numbers_that_json_does_not_know_are_null(broken, without_figures, mission_text, tmp_path):
    flight = broken.results["trajectory"].flight
    nothing = type(flight)(**{**vars(flight), "fuel_per_segment": np.nan * flight.fuel_per_segment})
    lost = type(broken.results["trajectory"])(**{**vars(broken.results["trajectory"]), "flight": nothing})
    results = {**broken.results, "trajectory": lost}
    write_results(type(broken)(**{**vars(broken), "results": results}), tmp_path, mission_text=mission_text)
    figures = strict((tmp_path / "summary.json").read_text(encoding="utf-8"))["schedules"]["trajectory"]
    assert figures["fuel_kg"] is None and figures["fuel_physics_kg"] is None
    assert np.isnan(read_result(tmp_path / "result.nc")["fuel"].sel(schedule="trajectory"))
    assert "failed" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_result_holds_every_time_series_with_its_unit(folder, comparison):
    data = read_result(folder / "result.nc")
    assert list(data["schedule"].values) == list(comparison.results)
    for name, result in comparison.results.items():
        one, flight = data.sel(schedule=name), result.flight
        np.testing.assert_array_equal(one["mass"], flight.mass)
        np.testing.assert_array_equal(one["rotor_speed_percent"], 100 / 44.4 * flight.rotor_speed)
        np.testing.assert_array_equal(one["twist_deg"], np.degrees(flight.twist))
        np.testing.assert_array_equal(one["fuel_flow"], flight.fuel_flow)
        np.testing.assert_array_equal(one["power_per_engine"], flight.power_per_engine)
        usage = np.where(np.isfinite(flight.limits), 1 + flight.limits, np.nan)
        np.testing.assert_array_equal(one["limit_usage"], usage)
        np.testing.assert_array_equal(one["physics_fuel_flow"], result.physics.fuel_flow)
        np.testing.assert_array_equal(one["physics_limit_usage"], result.physics.usages)
        assert float(one["fuel"]) == flight.fuel and float(one["physics_fuel"]) == result.physics.fuel
        assert str(one["message"].values) == result.message and bool(one["success"]) == result.success
        # fuel flow belongs to the mass history: what is burned is what the aircraft gets lighter by
        burned = trapezoid(one["fuel_flow"], one["time"])
        assert burned == pytest.approx(flight.mass[0] + 50.0 - flight.mass[-1], rel=0.01)
    nodes = comparison.profile.conditions(data["segment_index"].values, data["time"].values)
    conditions = (
        "speed",
        "altitude",
        "climb_angle",
        "load_factor",
        "turn_load_factor",
        "height",
        "idle",
        "ground_idle",
    )
    for name in (*conditions, "equivalent_climb_angle"):
        np.testing.assert_array_equal(data[name], getattr(nodes, name))
    np.testing.assert_allclose(data["bank"], nodes.turn * np.arccos(1 / nodes.turn_load_factor))
    latitude, longitude = comparison.profile.positions(data["segment_index"].values, data["time"].values)
    np.testing.assert_allclose(data["latitude_deg"], latitude, rtol=0, atol=1e-12)
    np.testing.assert_allclose(data["longitude_deg"], longitude, rtol=0, atol=1e-12)
    assert float(data["ground_distance"].sum()) == pytest.approx(float(data["distance"][-1]))
    np.testing.assert_allclose(data["segment_fuel"].sum("segment"), data["fuel"])
    assert list(data["task"].values) == [segment.task for segment in comparison.profile.segments]
    np.testing.assert_allclose(data["band_lower_percent"], 100 * comparison.band.lower / 44.4)
    units = {
        "mass": "kg",
        "twist_deg": "deg",
        "fuel_flow": "kg/s",
        "power_per_engine": "W",
        "speed": "m/s",
        "time": "s",
    }
    assert {name: data[name].attrs["units"] for name in units} == units
    texts = {"schedule", "limit", "task", "kind", "message", "phase", "end", "part", "cause"}
    assert all("units" in data[name].attrs for name in data.variables if name not in texts)


def test_result_holds_emissions_over_time_in_total_and_by_phase(folder, comparison):
    data = read_result(folder / "result.nc")
    for name, result in comparison.results.items():
        one, own = data.sel(schedule=name), result.emissions
        for species in ("co2", "nox", "co", "foca_nox"):
            np.testing.assert_array_equal(one[f"{species}_flow"], own.flow[species])
            assert float(one[species]) == own.total(species)
        np.testing.assert_array_equal(one["nox_range"], own.nox_range)
        np.testing.assert_array_equal(one["physics_nox_flow"], result.physics.emissions.flow["nox"])
        assert float(one["physics_nox"]) == result.physics.emissions.total("nox")
        for species in ("fuel", "co2", "nox", "co"):
            assert float(one[f"phase_{species}"].sum()) == pytest.approx(float(one[species]), rel=1e-9)
    assert data["nox_flow"].attrs["units"] == "kg/s" and data["phase_nox"].attrs["units"] == "kg"
    assert list(data["phase"].values) == ["idle", "hover", "climb", "cruise", "loiter", "descent"]
    assert list(data["end"].values) == ["least", "largest"]


def test_result_holds_what_is_needed_to_repeat_it(folder, comparison, mission_text):
    attributes = read_result(folder / "result.nc").attrs
    assert attributes["mission_text"] == mission_text
    assert attributes["takeoff_mass_kg"] == comparison.loading.takeoff_mass
    assert attributes["data_hash"] == comparison.provenance["data_hash"]
    assert attributes["search_seed"] == "1" and attributes["design_seed"] == str(comparison.provenance["design_seed"])
    assert attributes["free_variables"] == "both"
    assert attributes["trajectory_residual_norm"] == comparison.trajectory.max_residual
    assert attributes["model_version"] and attributes["casadi_version"] and attributes["vrsopt_version"]
    alone = read_result(folder / "twist_only" / "result.nc")
    assert alone.attrs["free_variables"] == "twist"
    np.testing.assert_allclose(alone["rotor_speed_percent"], 100.0)


def test_idle_has_no_use_of_limits(comparison, without_figures, mission_text, tmp_path):
    write_results(comparison, tmp_path, mission_text=mission_text)
    data = read_result(tmp_path / "result.nc")
    usage, idle = data["limit_usage"].sel(schedule="nominal").values, data["idle"].values == 1
    assert 0 < idle.sum() < len(idle)
    assert np.isnan(usage[:, idle]).all() and np.isfinite(usage[:, ~idle]).all()


class Page(HTMLParser):
    """Tags, links and texts of a page; fails on tags that are not closed."""

    def __init__(self):
        super().__init__()
        self.open, self.links, self.texts, self.tags = [], [], [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.links += [value for name, value in attrs if name in ("src", "href", "srcset")]
        if tag not in ("meta", "img"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


def test_page_is_complete_and_needs_nothing_else(folder, comparison, mission_text):
    text = (folder / "report.html").read_text(encoding="utf-8")
    page = Page()
    page.feed(text)
    page.close()
    assert not page.open
    assert "://" not in text and "script" not in page.tags and "link" not in page.tags and "url(" not in text
    inside = [link for link in page.links if link.startswith("#")]
    assert len(inside) > 10 and all(f'id="{link[1:]}"' in text for link in inside)
    pictures = [link.removeprefix("data:image/png;base64,") for link in page.links if link not in inside]
    files = [folder / part / f"{name}.png" for part in ("", "twist_only") for name in ON_PAGE]
    assert [base64.b64decode(picture, validate=True) for picture in pictures] == [file.read_bytes() for file in files]
    words = "".join(page.texts)
    assert mission_text in words and "Hop <über>" in words
    for name, result in comparison.results.items():
        assert f"{result.flight.fuel:.2f}" in words and result.message in words, name
    for result in comparison.results.values():
        assert f"{1e3 * result.emissions.total('nox'):.1f}" in words
    assert "range over the fits" in words and "indicative" in words and "FOCA's guidance" in words
    assert "width=device-width" in text


def test_notes_on_the_mission_are_in_report_and_summary(comparison, without_figures, mission_text, tmp_path):
    notes = ("Altitude of the track <GPS> smoothed over 20 s.", "Two gaps filled.")
    mission = FlownMission("flight", 2000.0, comparison.profile, comparison.mission.places, notes, "0" * 64)
    told = replace(comparison, mission=mission)
    write_results(told, tmp_path, mission_text=mission_text)
    assert strict((tmp_path / "summary.json").read_text(encoding="utf-8"))["notes"] == list(notes)
    page = Page()
    page.feed((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert page.texts.index(notes[0]) < page.texts.index(notes[1])
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert text.index('id="flight"') < text.index(notes[1]) < text.index('id="schedules"'), "beside the map"
    write_results(comparison, tmp_path, mission_text=mission_text)
    assert "notes" not in strict((tmp_path / "summary.json").read_text(encoding="utf-8"))


def test_files_are_the_same_every_time(comparison, without_figures, mission_text, tmp_path):
    for folder in ("one", "two"):
        write_results(comparison, tmp_path / folder, mission_text=mission_text)
    for file in (tmp_path / "one").iterdir():
        assert file.read_bytes() == (tmp_path / "two" / file.name).read_bytes(), file.name


def test_other_files_stay_and_old_results_are_replaced(comparison, mission_text, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "summary.json").write_text("old")
    write_results(comparison, tmp_path, mission_text=mission_text)
    assert (tmp_path / "notes.txt").read_text() == "mine"
    assert strict((tmp_path / "summary.json").read_text(encoding="utf-8"))["mission"] == "Hop <über>"
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
        [*FIGURES, *DATA, "report.html", "summary.json", "notes.txt"]
    )


def test_unusable_folders_are_refused_in_one_line(comparison, without_figures, mission_text, tmp_path):
    file = tmp_path / "file"
    file.write_text("mine")
    (tmp_path / "half" / "result.nc").mkdir(parents=True)
    (tmp_path / "half" / "summary.json").write_text("old")
    for place in (file, file / "below", tmp_path / "half"):
        with pytest.raises(InputError) as error:
            write_results(comparison, place, mission_text=mission_text)
        assert str(place) in str(error.value) and "\n" not in str(error.value)
    assert file.read_text() == "mine"
    assert sorted(path.name for path in (tmp_path / "half").iterdir()) == ["result.nc", "summary.json"]
    assert (tmp_path / "half" / "summary.json").read_text() == "old"


def test_a_failure_on_the_way_leaves_nothing_behind(comparison, without_figures, mission_text, tmp_path, monkeypatch):
    (tmp_path / "summary.json").write_text("old")

    def full(self, content):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.write_bytes", full)
    with pytest.raises(InputError, match="can not be written: No space left on device"):
        write_results(comparison, tmp_path, mission_text=mission_text)
    assert [path.name for path in tmp_path.iterdir()] == ["summary.json"]
    assert (tmp_path / "summary.json").read_text() == "old"


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is forbidden to the superuser")
def test_a_folder_without_permission_is_refused(comparison, without_figures, mission_text, tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(InputError, match="can not be written"):
        write_results(comparison, tmp_path / "results", mission_text=mission_text)


def test_only_results_are_read(folder, tmp_path):
    path = tmp_path / "result.nc"
    with pytest.raises(InputError, match="can not be read"):
        read_result(path)
    content = (folder / "result.nc").read_bytes()
    for bad in (b"", b"CDF\x02", content[:5000], b"\x80\x04pickle", b"\x89HDF\r\n\x1a\n"):
        path.write_bytes(bad)
        with pytest.raises(InputError, match="not a result"):
            read_result(path)
    xr.Dataset({"x": ("n", [1.0])}).to_netcdf(path, engine="scipy")
    with pytest.raises(InputError, match="no attribute format"):
        read_result(path)
    xr.Dataset(attrs={"format": "vrsopt result", "format_version": "9"}).to_netcdf(path, engine="scipy")
    with pytest.raises(InputError, match="format_version = '9'"):
        read_result(path)
    xr.Dataset(attrs={"format": "vrsopt result", "format_version": "2"}).to_netcdf(path, engine="scipy")
    with pytest.raises(InputError, match="not a complete result"):
        read_result(path)
