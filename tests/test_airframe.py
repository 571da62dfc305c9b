"""Airframe: published polynomials and tables, smooth over the whole circle; tail surfaces, damping, symmetry."""

from typing import Any

import casadi as ca
import numpy as np
import pytest

from vrsopt.aircraft import Aircraft, load_aircraft
from vrsopt.airframe import airframe_loads, local_velocity, series_coefficients
from vrsopt.atmosphere import Air, standard_air

AIRCRAFT = load_aircraft("bo105")
FUSELAGE = AIRCRAFT.fuselage
AIR = standard_air(0.0)
OWN_AREA = 580.6 / (0.5 * AIR.density * 30.48**2)
LENGTH = FUSELAGE.length
# index in (X, Y, Z, L, M, N), polynomial, area, length, table, plane of the angle
PARTS = {
    "X": (0, FUSELAGE.force_x, 7.5, 1.0, FUSELAGE.far_x, "attack"),
    "Z": (2, FUSELAGE.force_z, 7.5, 1.0, FUSELAGE.far_z, "attack"),
    "M": (4, FUSELAGE.moment_y, 7.5, LENGTH, FUSELAGE.far_moment_y, "attack"),
    "Y": (1, FUSELAGE.force_y, 8.3, 1.0, FUSELAGE.far_y, "sideslip"),
    "N": (5, FUSELAGE.moment_z, 8.3, LENGTH, FUSELAGE.far_moment_z, "sideslip"),
}


def only(part: str) -> Aircraft:
    """The aircraft with the area of the other tail surfaces next to nothing; no part leaves the fuselage."""
    small = {name: getattr(AIRCRAFT, name).replaced(area=1e-9) for name in ("tailplane", "fin") if name != part}
    return AIRCRAFT.replaced(**small)


def function(aircraft: Aircraft = AIRCRAFT, *, air: Air = AIR, parasite_area: float = OWN_AREA, **keywords: Any) -> Any:
    """(u, v, w, p, q, r) -> (X, Y, Z, L, M, N)."""
    x = ca.MX.sym("x", 6)
    u, v, w, p, q, r = ca.vertsplit(x)
    keywords = {"downwash": 0.0, **keywords}
    loads = airframe_loads(
        aircraft, velocity=(u, v, w), rates=(p, q, r), air=air, parasite_area=parasite_area, **keywords
    )
    return ca.Function("loads", [x], [ca.vertcat(loads.force, loads.moment)])


def jacobian(loads: Any) -> Any:
    x = ca.MX.sym("x", 6)
    return ca.Function("jacobian", [x], [ca.jacobian(loads(x), x)])


def at(loads: Any, *state: float) -> np.ndarray:
    return np.array(loads([*state, *[0.0] * (6 - len(state))])).ravel()


def flow(angle_deg: Any, plane: str, speed: float = 30.48) -> np.ndarray:
    """States (6, n) of flow at an angle of attack or sideslip."""
    angle = np.radians(np.atleast_1d(angle_deg))
    states = np.zeros((6, angle.size))
    states[0] = speed * np.cos(angle)
    states[2 if plane == "attack" else 1] = speed * np.sin(angle)
    return states


FUSELAGE_ONLY = function(only("fuselage"))


@pytest.mark.parametrize("name", PARTS)
def test_fuselage_is_the_published_polynomial_up_to_15_deg(name):
    row, published, *_, plane = PARTS[name]
    angles = np.linspace(-15, 15, 61)
    computed = np.array(FUSELAGE_ONLY.map(61)(flow(angles, plane)))[row]
    expected = np.polynomial.polynomial.polyval(np.radians(angles), published)
    np.testing.assert_allclose(computed, expected, atol=2e-5 * np.max(np.abs(expected)))


@pytest.mark.parametrize("name", PARTS)
def test_fuselage_follows_the_tables_beyond_25_deg(name):
    """The series is within 3 % of the largest value of the table, root mean square, and 11 % at its corners."""
    row, _, area, arm, table, plane = PARTS[name]
    angles = np.concatenate([np.arange(-180.0, -24.5, 0.5), np.arange(25.0, 180.5, 0.5)])
    scale = 0.5 * AIR.density * 30.48**2 * area * arm
    computed = np.array(FUSELAGE_ONLY.map(angles.size)(flow(angles, plane)))[row] / scale
    error = (computed - np.interp(angles, table.angle, table.coefficient)) / np.max(np.abs(table.coefficient))
    assert np.sqrt(np.mean(error**2)) < 0.03
    assert np.max(np.abs(error)) < 0.11


@pytest.mark.parametrize("name", PARTS)
def test_between_15_and_25_deg_the_fuselage_lies_between_both(name):
    row, published, area, arm, table, plane = PARTS[name]
    angles = np.concatenate([np.linspace(-25, -15, 41), np.linspace(15, 25, 41)])
    computed = np.array(FUSELAGE_ONLY.map(82)(flow(angles, plane)))[row]
    near = np.polynomial.polynomial.polyval(np.radians(angles), published)
    orders = np.radians(angles)[:, None] * np.arange(1, 11)
    series = series_coefficients(table.angle, table.coefficient)
    far = series[0] + np.cos(orders) @ series[1::2] + np.sin(orders) @ series[2::2]
    far *= 0.5 * AIR.density * 30.48**2 * area * arm
    slack = 1e-4 * np.max(np.abs(near))
    assert np.all(computed <= np.maximum(near, far) + slack) and np.all(computed >= np.minimum(near, far) - slack)


@pytest.mark.parametrize("plane", ["attack", "sideslip"])
def test_smooth_over_the_whole_circle(plane):
    """Loads, slopes and curvature by angle have no jump, least of all at 15 and 25 deg and behind the aircraft."""
    angle = ca.MX.sym("angle")
    along, across = 40.0 * ca.cos(angle), 40.0 * ca.sin(angle)
    state = ca.vertcat(along, 0, across, 0, 0, 0) if plane == "attack" else ca.vertcat(along, across, 0, 0, 0, 0)
    loads = function(downwash=3.0, parasite_area=1.44)(state)
    slope = ca.jacobian(loads, angle)
    evaluate = ca.Function("circle", [angle], [loads, slope, ca.jacobian(slope, angle)])
    places = np.radians([-180, -90, -25, -15, 15, 25, 90, 180])
    for place in places:
        for before, after in zip(evaluate(place - 1e-8), evaluate(place + 1e-8), strict=True):
            size = np.max(np.abs(np.array(after))) + 1.0
            np.testing.assert_allclose(np.array(before), np.array(after), atol=2e-3 * size)
    for here, there in zip(evaluate(-np.pi), evaluate(np.pi), strict=True):
        np.testing.assert_allclose(np.array(here), np.array(there), rtol=1e-9, atol=1e-7)
    step = 1e-5
    for place in np.radians(np.arange(-180.0, 180.0, 7.0)):
        difference = (np.array(evaluate(place + step)[0]) - np.array(evaluate(place - step)[0])) / (2 * step)
        np.testing.assert_allclose(np.array(evaluate(place)[1]), difference, rtol=1e-5, atol=1e-2)


def test_at_rest_there_is_no_load_and_derivatives_are_finite():
    loads = function(parasite_area=1.44)
    np.testing.assert_allclose(at(loads), 0.0, atol=1e-9)
    derivative = jacobian(loads)
    second = ca.Function("second", [x := ca.MX.sym("x", 6)], [ca.jacobian(derivative(x), x)])
    for state in (np.zeros(6), 1e-3 * np.arange(6.0), [0, 1e-8, -1e-8, 0, 0, 0]):
        assert np.all(np.isfinite(np.array(derivative(state)))) and np.all(np.isfinite(np.array(second(state))))
        assert np.max(np.abs(np.array(derivative(state)))) < 5.0


@pytest.mark.parametrize("direction", [(1, 0, 0), (0, 1, 0), (0, 0, -1), (-1, 0.2, 0.3), (0.3, 0.8, 0.1)])
def test_loads_grow_with_density_and_the_square_of_speed(direction):
    one = at(function(parasite_area=1.44), *(20.0 * np.array(direction)))
    thin = standard_air(3000.0)
    other = at(function(air=thin, parasite_area=1.44), *(60.0 * np.array(direction)))
    np.testing.assert_allclose(other, 9 * thin.density / AIR.density * one, atol=5e-4 * np.max(np.abs(other)))


def test_mirrored_motion_gives_mirrored_loads():
    """Of an airframe whose fin has no incidence and whose fuselage has no published asymmetry."""
    odd = FUSELAGE.replaced(
        force_y=(0.0, FUSELAGE.force_y[1], 0.0, FUSELAGE.force_y[3]),
        far_y=FUSELAGE.far_y.replaced(coefficient=[0 if abs(c) < 0.01 else c for c in FUSELAGE.far_y.coefficient]),
    )
    loads = function(AIRCRAFT.replaced(fin=AIRCRAFT.fin.replaced(incidence=0.0), fuselage=odd), parasite_area=1.44)
    random = np.random.default_rng(1)
    mirror, signs = np.array([1, -1, 1, -1, 1, -1]), np.array([1, -1, 1, -1, 1, -1])
    for state in random.uniform([-40, -20, -20, -0.5, -0.5, -0.5], [60, 20, 20, 0.5, 0.5, 0.5], (20, 6)):
        np.testing.assert_allclose(at(loads, *(mirror * state)), signs * at(loads, *state), atol=1e-6)


@pytest.mark.parametrize("plane", ["attack", "sideslip"])
@pytest.mark.parametrize("part", ["tailplane", "fin", "all"])
def test_drag_takes_power_at_every_angle(part, plane):
    """The force along the velocity never drives the aircraft: of one tail surface, and of the whole."""
    states = flow(np.arange(-180.0, 180.0, 2.0), plane)
    if part == "all":
        loads = np.array(function(parasite_area=1.44).map(180)(states))
    else:
        loads = np.array(function(only(part)).map(180)(states)) - np.array(FUSELAGE_ONLY.map(180)(states))
    assert np.max(np.sum(loads[:3] * states[:3], axis=0)) < 1e-3  # W


def test_attached_tailplane_has_its_published_slope():
    """Lift 1/2 rho V^2 S a (incidence + alpha) up, normal to the flow, and its moment about the centre of gravity."""
    surface = AIRCRAFT.tailplane
    for pitch in (-0.12, -0.0698, 0.0, 0.03):
        state = (50.0 * np.cos(pitch), 0.0, 50.0 * np.sin(pitch))
        lift = 0.5 * AIR.density * 50.0**2 * 0.803 * 3.262 * (np.radians(4.0) + pitch)
        load = at(function(only("tailplane")), *state) - at(FUSELAGE_ONLY, *state)
        assert load[2] == pytest.approx(-lift * np.cos(pitch), rel=5e-3, abs=2.0)
        assert load[0] == pytest.approx(lift * np.sin(pitch), rel=5e-3, abs=2.0)
        assert load[4] == pytest.approx(surface.behind_cg * load[2], rel=1e-9)


@pytest.mark.parametrize("part, plane, row", [("tailplane", "attack", 2), ("fin", "sideslip", 1)])
def test_surfaces_stall_and_end_as_plates(part, plane, row):
    surface = getattr(AIRCRAFT, part)
    aircraft = only(part).replaced(**{part: surface.replaced(incidence=0.0)})
    angles = np.arange(-180.0, 180.5, 1.0)
    states = flow(angles, plane)
    load = np.array(function(aircraft).map(361)(states)) - np.array(FUSELAGE_ONLY.map(361)(states))
    pressure = 0.5 * AIR.density * 30.48**2 * surface.area
    across = -load[row] / pressure  # against the motion across
    alpha = np.radians(angles)
    lift = across * np.cos(alpha) + load[0] / pressure * np.sin(alpha)
    drag = across * np.sin(alpha) - load[0] / pressure * np.cos(alpha)
    np.testing.assert_allclose(lift, -lift[::-1], atol=1e-9)
    assert np.max(np.abs(lift)) == pytest.approx(surface.largest_lift, rel=0.05)
    plate = np.abs(angles) > 70
    np.testing.assert_allclose(lift[plate], 0.5 * surface.plate_normal_force * np.sin(2 * alpha[plate]), atol=0.01)
    assert across[angles == 90.0] == pytest.approx(surface.plate_normal_force, rel=1e-3)
    assert np.max(drag[np.abs(angles) < 12]) < 0.003  # attached: in the parasite area
    assert np.all(drag > -1e-9)


def test_downwash_pushes_the_tailplane_down_and_the_nose_up():
    base, washed = at(function(), 25.0), at(function(downwash=5.0), 25.0)
    assert washed[2] > base[2] + 100 and washed[4] > base[4] + 500
    np.testing.assert_allclose(washed[[1, 3, 5]], base[[1, 3, 5]], atol=1e-9)


def test_local_velocity_is_that_of_a_rigid_body():
    random = np.random.default_rng(2)
    for velocity, rates, arm in random.normal(size=(5, 3, 3)):
        np.testing.assert_allclose(local_velocity(velocity, rates, arm), velocity + np.cross(rates, arm), atol=1e-14)


@pytest.mark.parametrize("speed", [10.0, 30.0, 60.0])
def test_rates_are_damped(speed):
    """Each moment falls with its own rate. A slow wing: M_q = -1/2 rho V S a l^2 of the tailplane, N_r that of the
    fin, with its own lift and place."""
    slopes = np.array(jacobian(function(parasite_area=1.44))([speed, 0, 0, 0, 0, 0]))
    assert slopes[3, 3] < 0 and slopes[4, 4] < 0 and slopes[5, 5] < 0
    plane, fin = AIRCRAFT.tailplane, AIRCRAFT.fin
    half = 0.5 * AIR.density * speed
    assert slopes[4, 4] == pytest.approx(-half * plane.area * plane.lift_slope * plane.behind_cg**2, rel=0.03)
    assert slopes[5, 5] == pytest.approx(-half * fin.area * fin.lift_slope * fin.behind_cg**2, rel=0.03)


def test_fin_and_tailplane_act_against_the_unstable_fuselage():
    """The fuselage alone turns away from the flow: N falls with v and M rises with w. The fin takes back two thirds
    and leaves the rest to the tail rotor; the tailplane half: the aircraft is unstable in pitch, as the Bo 105 is."""
    alone = np.array(jacobian(FUSELAGE_ONLY)([40.0, 0, 0, 0, 0, 0]))
    whole = np.array(jacobian(function())([40.0, 0, 0, 0, 0, 0]))
    assert alone[5, 1] < 0 and 0.6 < 1 - whole[5, 1] / alone[5, 1] < 0.75
    assert alone[4, 2] > 0 and 0.5 < 1 - whole[4, 2] / alone[4, 2] < 0.6
    assert alone[5, 1] == pytest.approx(-10028.0 * (40.0 / 30.48) ** 2 / 40.0, rel=1e-3)


def test_a_shift_of_the_centre_of_gravity_moves_the_arms():
    state = (45.0, 3.0, -2.0)
    base, shifted = at(function(parasite_area=1.44), *state), at(function(parasite_area=1.44, cg_shift=0.1), *state)
    np.testing.assert_allclose(shifted[:3], base[:3], rtol=1e-12)
    np.testing.assert_allclose(shifted[3:], base[3:] - np.cross([0.1, 0.0, 0.0], base[:3]), rtol=1e-9, atol=1e-9)
    slopes = np.array(jacobian(function(cg_shift=0.1))([45.0, 0, 0, 0, 0, 0]))
    plane = AIRCRAFT.tailplane
    expected = -0.5 * AIR.density * 45.0 * plane.area * plane.lift_slope * (plane.behind_cg + 0.1) ** 2
    assert slopes[4, 4] == pytest.approx(expected, rel=0.03)


def test_extra_drag_acts_along_the_path_at_its_height():
    raised = AIRCRAFT.replaced(fuselage=FUSELAGE.replaced(extra_drag_above_cg=0.5))
    state = (30.0, 4.0, -6.0)
    extra = at(function(raised, parasite_area=OWN_AREA + 0.5), *state) - at(function(raised), *state)
    drag = 0.5 * AIR.density * 0.5 * float(np.dot(state, state))
    np.testing.assert_allclose(extra[:3], -drag * np.array(state) / np.linalg.norm(state), rtol=1e-4)
    np.testing.assert_allclose(extra[3:], np.cross([0, 0, -0.5], extra[:3]), atol=1e-9)
