"""Emissions along a flight: integrated as the fuel is, summed by phase, with the range over the combustor's fits."""

import numpy as np
import pytest

from tests.schedule.smooth_profiles import SmoothFlight
from vrsopt.combustor.emissions import fit_range
from vrsopt.helicopter import helicopter
from vrsopt.schedule.emission_summary import foca_estimates
from vrsopt.schedule.emissions import PHASES, changes, emitted, nox_fits, phases
from vrsopt.schedule.nominal import constant_schedule, nominal_schedule
from vrsopt.schedule.quadrature import filled, mean_of_sides, per_segment, sparse, thinned
from vrsopt.schedule.refly import FlightGrid


def test_sums_over_phases_are_the_totals_and_a_search_is_loiter(search, make_model):
    grid = FlightGrid(search, make_model())
    flight = grid.fly(nominal_schedule(search), takeoff_mass=2000.0)
    flown = grid.emissions(flight)
    parts = phases(search, flight.fuel_per_segment, flown)
    assert tuple(parts) == PHASES
    assert sum(phase.duration for phase in parts.values()) == pytest.approx(search.duration, rel=1e-12)
    assert sum(phase.fuel for phase in parts.values()) == pytest.approx(flight.fuel, rel=1e-9)
    for name in ("co2", "nox", "co"):
        total = sum(getattr(phase, name) for phase in parts.values())
        assert total == pytest.approx(flown.total(name), rel=1e-9)
    searching = sum(segment.duration for segment in search.segments if segment.kind == "search")
    assert parts["loiter"].duration == pytest.approx(searching)
    assert parts["idle"].nox > 0.0  # the engines run on the ground


def test_vertical_climb_counts_as_climb_and_ground_idle_as_idle(make_model):
    flight = SmoothFlight().hold("idle", 30.0).hold("ground_idle", 60.0).hold("hover", 20.0)
    profile = flight.change("lift", 6.0, climb_rate=2.0, kind="vertical_climb").hold("climb", 40.0).profile()
    grid = FlightGrid(profile, make_model())
    flown = grid.fly(nominal_schedule(profile), takeoff_mass=1900.0)
    parts = phases(profile, flown.fuel_per_segment, grid.emissions(flown))
    assert {name: phase.duration for name, phase in parts.items() if phase.duration} == pytest.approx(
        {"idle": 90.0, "hover": 20.0, "climb": 46.0}
    )
    machine = helicopter("bo105")
    assert foca_estimates(profile, machine.aircraft, machine.engine)[2] == 1


def test_what_is_proportional_to_fuel_is_integrated_as_the_fuel_is(transport, make_model):
    grid = FlightGrid(transport, make_model(), step=5.0)
    flight = grid.fly(constant_schedule(transport, rotor_speed=41.0, twist=0.15, name="slow"), takeoff_mass=2100.0)
    flown = grid.emissions(flight)
    np.testing.assert_allclose(flown.per_segment["co2"], 3.1 * flight.fuel_per_segment, rtol=1e-9)
    np.testing.assert_allclose(flown.flow["co2"], 3.1 * flight.fuel_flow, rtol=1e-9)
    assert flown.quadrature_error["co2"] == pytest.approx(3.1 * flight.quadrature_error, rel=1e-4)


def test_trapezoid_is_of_second_order_and_its_estimate_honest():
    def flown(count):
        time = np.concatenate([np.linspace(0.0, 10.0, count), np.linspace(10.0, 16.0, count)])
        segment = np.repeat([0, 1], count)
        flow = np.where(segment == 0, np.exp(0.2 * time), 3.0 + np.sin(time))  # jumps at the edge
        return emitted(segment, time, {"nox": np.stack([flow, flow], axis=1)}, 2)

    exact = np.array([(np.exp(2.0) - 1) / 0.2, 18.0 - np.cos(16.0) + np.cos(10.0)])
    coarse, fine = flown(9), flown(17)
    error = [np.abs(one.per_segment["nox"] - exact) for one in (coarse, fine)]
    assert np.log2(error[0] / error[1]) == pytest.approx([2.0, 2.0], abs=0.05)
    assert fine.quadrature_error["nox"] == pytest.approx(abs(fine.total("nox") - exact.sum()), rel=0.05)


def test_jumps_inside_a_segment_cost_no_accuracy():
    """A step in the middle of a piece-wise constant flow, known by its two sides."""
    segment, time = np.zeros(5, dtype=int), np.arange(5.0)
    sides = np.array([[1, 1], [1, 1], [1, 3], [3, 3], [3, 3]], dtype=float)
    assert per_segment(segment, time, sides, np.arange(5), 1) == pytest.approx([8.0])
    assert mean_of_sides(sides, segment) == pytest.approx([1, 1, 2, 3, 3])


def test_a_segment_without_a_number_spoils_itself_alone():
    segment, time = np.array([0, 0, 1, 1]), np.array([0.0, 1.0, 1.0, 2.0])
    sides = np.array([[1.0, 1.0], [1.0, np.nan], [2.0, 2.0], [2.0, 2.0]])
    assert per_segment(segment, time, sides, np.arange(4), 2) == pytest.approx([1.0, 2.0])
    sides[1, 0] = np.nan
    assert np.isnan(per_segment(segment, time, sides, np.arange(4), 2)[0])


def test_sparse_nodes_keep_edges_jumps_and_bends():
    segment = np.repeat([0, 1], [21, 11])
    time = np.concatenate([np.arange(21.0), np.arange(20.0, 31.0)])
    flow = np.where(segment == 0, np.maximum(1.0, 1.0 + 0.1 * (time - 10.0)), 5.0)
    sides = np.stack([flow, flow], axis=1)
    sides[25, 1] = 6.0
    sides[26:] = 6.0
    kept = sparse(segment, time, sides, tolerance=1e-6, longest=8)
    assert {0, 10, 20, 21, 25, 31} <= set(kept.tolist())  # ends, bend and jump
    assert len(kept) < 12 and np.max(np.diff(kept)) <= 8
    every = per_segment(segment, time, sides, np.arange(len(time)), 2)
    assert per_segment(segment, time, sides, kept, 2) == pytest.approx(every, rel=1e-9)
    np.testing.assert_allclose(filled(time, kept, sides[kept]), sides, rtol=1e-12)
    assert thinned(np.array([0, 0, 0, 0, 1, 1]), 2).tolist() == [0, 2, 3, 4, 5]


def test_range_is_over_the_fits_of_the_total_and_a_fit_is_compared_with_itself():
    segment, time = np.array([0, 0, 1, 1]), np.array([0.0, 1.0, 1.0, 2.0])

    def flown(**flows):
        return emitted(
            segment, time, {name: np.array([[a, a], [a, a], [b, b], [b, b]]) for name, (a, b) in flows.items()}, 2
        )

    # the fits cross between the segments: the total's range is narrower than the sum of the ranges
    one = flown(nox=(2.0, 3.0), nox_other=(3.0, 1.5), foca_nox=(9.0, 9.0), co=(1.0, 1.0))
    assert nox_fits(one.flow) == ["nox", "nox_other"]
    assert one.nox_range == (4.5, 5.0)
    base = flown(nox=(4.0, 4.0), nox_other=(3.0, 3.0), foca_nox=(9.0, 9.0), co=(1.0, 1.0))
    assert changes(one, base) == pytest.approx({"nox": -37.5, "nox_other": -25.0, "foca_nox": 0.0, "co": 0.0})
    assert changes(None, base) == {} and changes(one, None) == {}
    assert np.isnan(fit_range([1.0, np.nan])).all()
