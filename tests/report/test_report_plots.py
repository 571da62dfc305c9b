"""Figures hold what they should, and no text lies over another."""

import itertools

import numpy as np
import pytest
from matplotlib.image import imread

from vrsopt.mission.flight_path import flight_path
from vrsopt.mission.segment import KINDS
from vrsopt.report.plots import (
    emission_figure,
    figures,
    flight_path_figure,
    fuel_figure,
    mission_figure,
    phase_figure,
    png,
    saving_figure,
    schedule_figure,
)
from vrsopt.report.style import KIND_COLOURS, task_spans


def texts(figure):
    """Every visible text of a figure with its box in pixels."""
    renderer = figure.canvas.get_renderer()
    found = []
    for axes in figure.axes:
        ticks = []
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            margin = 1e-6 * (high - low)
            ticks += [tick.label1 for tick in axis.get_major_ticks() if low - margin <= tick.get_loc() <= high + margin]
        labels = [axes.title, axes._left_title, axes.xaxis.label, axes.yaxis.label]
        legend = axes.get_legend()
        entries = [*legend.get_texts(), legend.get_title()] if legend else []
        for text in (*ticks, *labels, *axes.texts, *entries):
            if text.get_visible() and text.get_text():
                box = type(text).get_window_extent(text, renderer)
                if box.width > 0:
                    found.append((text.get_text(), box))
    return found


ALL = [flight_path_figure, mission_figure, schedule_figure, saving_figure, fuel_figure, emission_figure, phase_figure]


@pytest.mark.parametrize("draw", ALL)
def test_no_text_overlaps_another_or_leaves_the_figure(windy, comparison, draw):
    figure = draw(windy if draw in (flight_path_figure, mission_figure) else comparison)
    figure.draw_without_rendering()
    found = [(text, box) for text, box in texts(figure)]
    assert len(found) > 10
    canvas = figure.bbox.padded(1.0)
    for text, box in found:
        assert canvas.contains(box.x0, box.y0) and canvas.contains(box.x1, box.y1), f"{text!r} is cut off"
    for (one, first), (other, second) in itertools.combinations(found, 2):
        assert not first.padded(-1.0).overlaps(second.padded(-1.0)), f"{one!r} over {other!r}"


@pytest.mark.parametrize("draw", ALL)
def test_legends_lie_outside_the_data(comparison, draw):
    figure = draw(comparison)
    figure.draw_without_rendering()
    for axes in figure.axes:
        if axes.get_legend():
            assert axes.get_legend().get_window_extent().x0 >= axes.bbox.x1


def test_schedules_are_drawn_with_bounds_and_units(comparison):
    axes = schedule_figure(comparison).axes
    assert [panel.get_ylabel() for panel in axes[1:]] == [
        "speed, m/s",
        "altitude, m",
        "rotor speed, %",
        "blade twist, deg",
        "fuel flow, kg/h",
        "use of limits, %",
    ]
    assert axes[-1].get_xlabel() == "time, min"
    assert axes[-1].get_xlim() == pytest.approx((0.0, comparison.profile.duration / 60))
    lines = {line.get_label(): line for line in axes[3].get_lines()}
    for name, text in (("nominal", "nominal"), ("trajectory", "trajectory")):
        flight = comparison.results[name].flight
        np.testing.assert_allclose(lines[text].get_xdata(), flight.time / 60)
        np.testing.assert_allclose(lines[text].get_ydata(), 100 * flight.rotor_speed / 44.4)
    bounds = sorted(float(line.get_ydata()[0]) for line in axes[3].get_lines() if len(line.get_ydata()) == 2)
    assert bounds == pytest.approx([75.0, 115.0])
    band = axes[3].collections[0].get_paths()[0].vertices[:, 1]
    assert band.min() == pytest.approx(100 * comparison.band.lower[:2].min() / 44.4)
    assert len(axes[3].collections) == 1  # one flight: nothing in idle, no seams between its segments


def test_use_of_limits_is_in_per_cent_of_what_is_allowed(comparison):
    panel = schedule_figure(comparison).axes[-1]
    lines = {line.get_label(): line.get_ydata() for line in panel.get_lines()}
    flight = comparison.results["trajectory"].flight
    torque = flight.limits[list(flight.time_on_limits).index("torque")]
    np.testing.assert_allclose(lines["torque"], np.where(np.isfinite(torque), 100 * (1 + torque), np.nan))
    assert lines["limit"][0] == 100.0


def way_on(axes):
    """What is drawn of the way on a map, in km."""
    return np.concatenate([line.get_xydata() for line in axes.lines if line.get_color() in KIND_COLOURS.values()])


def test_the_map_is_to_scale_in_kilometres(windy):
    axes = flight_path_figure(windy).axes[0]
    assert axes.get_aspect() == 1.0
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("east, km", "north, km")
    assert {"base", "quay"} <= {text.get_text() for text in axes.texts}
    path = flight_path(windy.profile)
    # one way along a meridian: arcs of a radius of curvature near 6360 km
    north = np.radians(float(path["latitude_deg"][-1] - path["latitude_deg"][0])) * 6359.1
    assert np.ptp(way_on(axes)[:, 1]) == pytest.approx(north, rel=1e-3)
    assert np.ptp(way_on(axes)[:, 0]) == pytest.approx(0.6, abs=2e-3)  # the circle to the left, radius 300 m
    bar = next(line for line in axes.lines if line.get_linewidth() == 2.5)
    words = next(text.get_text() for text in axes.texts if text.get_text().endswith(" km"))
    assert np.ptp(bar.get_xdata()) == pytest.approx(float(words.removesuffix(" km")))


def test_the_wind_blows_from_where_it_is_said_to(windy, comparison):
    compass = flight_path_figure(windy).axes[0].child_axes[0]
    assert {text.get_text() for text in compass.texts} == {"", "N", "wind 8.0 m/s\nfrom 240°"}
    blown = next(text for text in compass.texts if getattr(text, "arrow_patch", None) and text.xy[0] != 0.0)
    assert blown.xy == pytest.approx((np.sin(np.radians(60)), np.cos(np.radians(60))))  # toward 060
    calm = flight_path_figure(comparison).axes[0].child_axes[0]
    assert {text.get_text() for text in calm.texts} == {"", "N"}


def test_a_small_pattern_has_a_map_of_its_own(comparison):
    whole, pattern = flight_path_figure(comparison).axes
    assert pattern.get_title(loc="left") == "a: loiter" and "a" in {text.get_text() for text in whole.texts}
    circle = next(line for line in pattern.lines if line.get_color() == KIND_COLOURS["loiter"]).get_xydata()
    for axes, least in ((whole, 0.0), (pattern, 0.5)):
        (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
        assert left < circle[:, 0].min() and circle[:, 0].max() < right
        assert bottom < circle[:, 1].min() and circle[:, 1].max() < top
        assert np.ptp(circle[:, 1]) > least * (top - bottom)


def test_the_mission_profile_shows_what_is_flown(windy):
    strip, altitude, speed, angle, bank, load, mass, fuel = mission_figure(windy).axes
    path = flight_path(windy.profile)
    for axes, label, values in (
        (altitude, "aircraft", path["altitude"]),
        (speed, "true airspeed", path["speed"]),
        (speed, "over the ground", path["ground_speed"]),
        (angle, "flight path", np.degrees(path["climb_angle"])),
    ):
        line = next(line for line in axes.get_lines() if line.get_label() == label)
        np.testing.assert_array_equal(line.get_xdata(), path["time"] / 60)
        np.testing.assert_array_equal(line.get_ydata(), values)
    np.testing.assert_array_equal(bank.get_lines()[0].get_ydata(), np.degrees(path["bank"]))
    assert bank.get_lines()[0].get_ydata().min() < -25  # the circle is flown to the left
    np.testing.assert_array_equal(load.get_lines()[0].get_ydata(), path["load_factor"])
    flown = {line.get_label(): line.get_ydata() for line in fuel.get_lines()}
    np.testing.assert_allclose(flown["nominal"], 3600 * windy.results["nominal"].flight.fuel_flow)
    heavy = {line.get_label(): line.get_ydata() for line in mass.get_lines()}
    np.testing.assert_allclose(heavy["trajectory"], windy.results["trajectory"].flight.mass)
    ground = next(line for line in altitude.get_lines() if line.get_label() == "ground").get_ydata()
    assert ground[0] == 0.0 and ground[-1] == pytest.approx(18.0) and np.isnan(ground[len(ground) // 2])


def test_fuel_bars_have_the_fuel_of_surrogate_and_physics(comparison, broken):
    axes = fuel_figure(comparison).axes[0]
    surrogate, physics = ([bar.get_height() for bar in bars] for bars in axes.containers)
    assert surrogate == pytest.approx([result.flight.fuel for result in comparison.results.values()])
    assert physics == pytest.approx([result.physics.fuel for result in comparison.results.values()])
    names = [text.get_text() for text in fuel_figure(broken).axes[0].get_xticklabels()]
    assert names[1] == "pointwise\ninfeasible" and names[-1] == "trajectory\nfailed"
    assert "none" in [text.get_text() for text in fuel_figure(broken).axes[0].texts]


def test_emissions_are_drawn_in_grams_with_the_range_of_nox(two_fits):
    nox, co = emission_figure(two_fits).axes[1:]
    assert (nox.get_ylabel(), co.get_ylabel()) == ("NOx, g/min", "CO, g/min")
    lines = {line.get_label(): line.get_ydata() for line in nox.get_lines()}
    flow = two_fits.results["trajectory"].emissions.flow
    np.testing.assert_allclose(lines["trajectory"], 6e4 * flow["nox"])
    band = np.concatenate([piece.get_paths()[0].vertices[:, 1] for piece in nox.collections])
    assert band.max() == pytest.approx(6e4 * 1.2 * flow["nox"].max(), rel=1e-9)


def test_bars_by_phase_have_whiskers_from_the_least_to_the_largest_fit(two_fits):
    axes = phase_figure(two_fits).axes[0]
    names = [text.get_text() for text in axes.get_xticklabels()]
    assert names == ["idle\n(indicative)", "hover", "climb", "cruise", "loiter", "descent"]
    bars = [container for container in axes.containers if hasattr(container, "errorbar")]
    assert [container.get_label() for container in bars][0] == "nominal"
    emissions = two_fits.results["nominal"].emissions
    heights = [bar.get_height() for bar in bars[0]]
    assert sum(heights) == pytest.approx(1e3 * emissions.total("nox"))
    whiskers = bars[0].errorbar.lines[2][0].get_segments()
    for height, whisker in zip(heights, whiskers, strict=True):
        assert whisker[:, 1] == pytest.approx([height, 1.2 * height])


def test_pngs_are_pictures_and_always_the_same(comparison, tmp_path):
    for name, figure in figures(comparison).items():
        (tmp_path / f"{name}.png").write_bytes(png(figure))
        pixels = imread(tmp_path / f"{name}.png")
        assert min(pixels.shape[:2]) > 300, name
        assert 0.02 < np.mean(pixels[..., :3].min(axis=-1) < 0.9) < 0.9
    assert png(fuel_figure(comparison)) == png(fuel_figure(comparison))


def test_the_users_own_plots_are_left_alone(comparison):
    from matplotlib import rcParams
    from matplotlib._pylab_helpers import Gcf

    before = dict(rcParams)
    png(fuel_figure(comparison))
    assert not Gcf.figs and dict(rcParams) == before


def test_neighbouring_segments_of_one_task_are_one_span(comparison):
    spans = task_spans(comparison.profile)
    kinds = ["ground_idle", "idle", "hover", "vertical_climb", "climb", "cruise", "loiter", "cruise", "descent"]
    assert [span.kind for span in spans] == [*kinds, "hover", "hover"]
    assert [len(span.segments) for span in spans] == [1, 1, 1, 2, 3, 1, 1, 1, 3, 1, 1]
    assert spans[0].start == 0.0 and spans[-1].end == pytest.approx(comparison.profile.duration)
    for one, other in itertools.pairwise(spans):
        assert one.end == other.start and one.segments.stop == other.segments.start


def test_every_kind_of_task_has_its_colour():
    assert set(KIND_COLOURS) == set(KINDS) and len(set(KIND_COLOURS.values())) == len(KINDS)
