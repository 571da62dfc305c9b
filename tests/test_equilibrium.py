"""Trim: energy, forces re-checked by hand, signs, invariances, resolution, exact derivatives, both solvers."""

from functools import cache

import numpy as np
import pytest

from vrsopt.aircraft import load_aircraft
from vrsopt.atmosphere import GRAVITY, density_altitude, standard_air
from vrsopt.equilibrium import FLIGHT_PARAMETERS, calibrated_constants, trim_system
from vrsopt.residual import TOLERANCE
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.solution import Solution
from vrsopt.trim_guess import momentum_guess

AIRCRAFT = load_aircraft("bo105")
CONSTANTS = calibrated_constants(AIRCRAFT)
SYSTEM = trim_system(AIRCRAFT)
ROTOR = AIRCRAFT.main_rotor
NOMINAL = ROTOR.nominal_rotor_speed


def parameters(speed: float, **changes: float) -> dict[str, float]:
    flight = {
        "mass": 2200.0,
        "altitude": 0.0,
        "isa_offset": 0.0,
        "speed": speed,
        "climb_angle": 0.0,
        "vertical_speed": 0.0,
        "turn_rate": 0.0,
        "rotor_speed": NOMINAL,
        "twist": ROTOR.twist,
        "ground_proximity": 0.0,
        "cg_shift": 0.0,
    }
    assert set(flight) == {named.name for named in FLIGHT_PARAMETERS}
    return {**flight, **CONSTANTS, **changes}


def trimmed(speed: float, **changes: float) -> Solution:
    return _trimmed(speed, tuple(sorted(changes.items())))


@cache
def _trimmed(speed: float, changes: tuple[tuple[str, float], ...]) -> Solution:
    solution = SYSTEM.solve(parameters(speed, **dict(changes)), method="newton")
    assert solution.success, solution.message
    return solution


def rotor_power(solution: Solution) -> float:
    return solution.outputs["main_rotor_power"] + solution.outputs["tail_rotor_power"]


# -- energy -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "speed, climb_angle",
    [(0.0, 0.0), (10.0, 0.1), (10.0, -0.1), (30.0, 0.1), (30.0, -0.1), (50.0, 0.1), (50.0, -0.1), (65.0, 0.0)],
)
def test_power_is_induced_profile_and_propulsive(speed, climb_angle):
    """The rest is the work of structural damping on the bending blade, well below a per cent, and always spent.

    The whole aircraft: everything that air takes away, each its own integral, and the climb.
    """
    out = trimmed(speed, climb_angle=climb_angle).outputs
    parts = out["induced_power"] + out["profile_power"] + out["propulsive_power"]
    assert parts == pytest.approx(out["main_rotor_power"], rel=6e-3)
    assert parts < out["main_rotor_power"]
    names = ("induced", "profile", "parasite", "climb", "tail_rotor")
    whole = sum(out[f"{name}_power"] for name in names)
    total = out["main_rotor_power"] + out["tail_rotor_power"]
    assert whole == pytest.approx(total, rel=6e-3)
    assert whole < total


def test_hover():
    out = trimmed(0.0).outputs
    ideal = out["thrust"] ** 1.5 / np.sqrt(2 * standard_air(0.0).density * np.pi * ROTOR.radius**2)
    assert 1.1 < out["induced_power"] / ideal < 1.25
    solidity_power = ROTOR.solidity / 8 * standard_air(0.0).density * np.pi * ROTOR.radius**2
    solidity_power *= (NOMINAL * ROTOR.radius) ** 3
    assert 0.0085 < out["profile_power"] / solidity_power < 0.0115  # mean drag coefficient
    assert out["propulsive_power"] == pytest.approx(0.0, abs=1.0)


@pytest.mark.parametrize("speed", [25.0, 30.0, 40.0])
def test_climb_costs_the_potential_energy_and_a_little_more(speed):
    """Extra power over W Vc: above one, for thrust, download and tail rotor grow with power; a climb efficiency of
    0.8 to 0.85 (1.18 to 1.25) is the customary lower end. A descent gives back at most about as much."""
    level, rate = trimmed(speed), 5.0
    up = trimmed(speed, climb_angle=float(np.arcsin(rate / speed)))
    factor = (rotor_power(up) - rotor_power(level)) / (2200 * GRAVITY * rate)
    assert 1.0 < factor < 1.25
    down = trimmed(speed, climb_angle=-float(np.arcsin(3.0 / speed)))
    assert 0.8 < (rotor_power(level) - rotor_power(down)) / (2200 * GRAVITY * 3.0) < factor


# -- forces by hand -----------------------------------------------------------------------------------------------


def test_hover_forces():
    """Thrust carries weight and download; tail thrust balances the torque; the roll balances the tail thrust."""
    solution = trimmed(0.0)
    v, out, tail = solution.values, solution.outputs, AIRCRAFT.tail_rotor
    weight = 2200 * GRAVITY
    vertical = weight * np.cos(v["pitch"]) * np.cos(v["roll"])
    assert out["thrust"] * (1 - ROTOR.download_fraction) == pytest.approx(vertical, rel=2e-3)
    torque = out["main_rotor_power"] / NOMINAL
    assert tail.fin_blockage * out["tail_thrust"] * tail.behind_cg == pytest.approx(torque, rel=0.02)
    side = -weight * np.sin(v["roll"]) * np.cos(v["pitch"])
    # the hub sits lower than the tail rotor: a part of the side force is the main rotor's
    assert 0.6 < tail.fin_blockage * out["tail_thrust"] / side < 1.4


@pytest.mark.parametrize("speed", [40.0, 60.0])
def test_propulsive_power_is_drag_times_speed(speed):
    """Fuselage polynomials and drag area, tailplane and tail rotor, in wind axes; written out separately."""
    solution = trimmed(speed)
    alpha, air = solution.values["pitch"], standard_air(0.0)  # level flight, nearly no roll
    fuselage, surface = AIRCRAFT.fuselage, AIRCRAFT.tailplane
    scale = speed**2 / fuselage.reference_speed**2
    X = scale * np.polyval(fuselage.force_x[::-1], alpha)
    Z = scale * np.polyval(fuselage.force_z[::-1], alpha)
    body_drag = -(X * np.cos(alpha) + Z * np.sin(alpha))
    own_area = 580.6 / (0.5 * 1.225 * 30.48**2)
    body_drag += 0.5 * air.density * speed**2 * (CONSTANTS["parasite_area"] - own_area)
    downwash = surface.downwash_factor * solution.outputs["mean_induced_velocity"]
    lift = 0.5 * air.density * speed**2 * surface.area * surface.lift_slope
    lift *= np.radians(surface.incidence) + alpha - downwash / speed
    body_drag += lift * downwash / speed
    propulsive = solution.outputs["propulsive_power"] / speed
    assert propulsive == pytest.approx(body_drag, rel=0.05)  # the tail rotor's drag is two or three per cent


def test_signs_of_attitude_and_controls():
    hover, cruise = trimmed(0.0).values, trimmed(55.0).values
    assert hover["roll"] < 0 and cruise["roll"] < 0  # tail thrust to the right: left side low
    assert hover["pitch"] > cruise["pitch"] and cruise["pitch"] < 0  # nose-down to fly fast
    assert cruise["longitudinal_cyclic"] < hover["longitudinal_cyclic"] - 0.02  # stick forward
    assert trimmed(20.0).values["lateral_cyclic"] > hover["lateral_cyclic"]  # inflow gradient in transition
    assert hover["tail_collective"] > cruise["tail_collective"] > 0
    assert trimmed(30.0, climb_angle=0.1).values["collective"] > trimmed(30.0).values["collective"]
    fin = AIRCRAFT.fin
    assert fin.incidence > 0  # unloads the tail rotor: less thrust than the torque alone asks for
    out = trimmed(55.0).outputs
    kept = AIRCRAFT.tail_rotor.fin_blockage * out["tail_thrust"] * AIRCRAFT.tail_rotor.behind_cg
    assert kept < 0.9 * out["main_rotor_power"] / NOMINAL


def test_body_angle_in_a_climb():
    """Climb angle = pitch - angle of attack without roll: the attitude rises by about the climb angle."""
    level, climb = trimmed(40.0).values["pitch"], trimmed(40.0, climb_angle=0.08).values["pitch"]
    assert 0.0 < climb - level < 0.08
    # the same flight path with the drag of the climb's longer thrust taken off: rotor tilt rises with weight sin(gamma)
    out = trimmed(40.0, climb_angle=0.08).outputs
    extra = out["propulsive_power"] - trimmed(40.0).outputs["propulsive_power"]
    assert extra == pytest.approx(2200 * GRAVITY * 40.0 * np.sin(0.08), rel=0.1)


# -- invariances --------------------------------------------------------------------------------------------------


def test_equal_density_is_equal_power_but_for_mach_number():
    """A standard day at the density altitude of a warm one: only the Mach number differs, the warm air's is lower."""
    altitude, offset = 800.0, 20.0
    same = density_altitude(altitude, offset)
    for speed, largest in ((0.0, 0.01), (30.0, 0.025), (60.0, 0.07)):
        warm = trimmed(speed, altitude=altitude, isa_offset=offset).outputs["main_rotor_power"]
        standard = trimmed(speed, altitude=same).outputs["main_rotor_power"]
        assert 0 < 1 - warm / standard < largest


def test_thinner_air_costs_power_in_hover_and_saves_drag_in_fast_flight():
    assert rotor_power(trimmed(0.0, altitude=1500.0)) > rotor_power(trimmed(0.0)) * 1.02
    fast = [trimmed(65.0, mass=1800.0, altitude=h).outputs["propulsive_power"] for h in (0.0, 1000.0)]
    assert fast[1] < fast[0]


def test_smooth_through_hover():
    """No kink at zero speed: the power's slope vanishes, the controls move in proportion."""
    powers = [rotor_power(trimmed(v)) for v in (0.0, 0.5, 1.0)]
    assert powers[0] > powers[1] > powers[2] and powers[0] - powers[2] < 0.02 * powers[0]
    assert trimmed(0.01).values["lateral_cyclic"] == pytest.approx(trimmed(0.0).values["lateral_cyclic"], abs=1e-4)


# -- numbers ------------------------------------------------------------------------------------------------------

SAMPLE = (
    parameters(0.0),
    parameters(30.0),
    parameters(60.0),
    parameters(65.0, mass=2400.0),
    parameters(40.0, mass=2400.0, rotor_speed=0.85 * NOMINAL, altitude=1500.0),
    parameters(40.0, mass=2000.0, altitude=500.0, climb_angle=0.05, turn_rate=0.2, cg_shift=0.05),
    parameters(5.0, ground_proximity=0.8),
)
NAMES = ("hover", "bucket", "fast", "heavy", "slow rotor", "climbing turn", "near ground")


@pytest.mark.slow
@pytest.mark.parametrize(
    "finer",
    [Fidelity(harmonics=6, azimuths=48), Fidelity(azimuths=72), Fidelity(stations=20)],
    ids=["harmonics", "azimuths", "stations"],
)
def test_default_resolution_gives_power_to_a_part_in_a_thousand(finer):
    fine = trim_system(AIRCRAFT, finer)
    for point in SAMPLE:
        reference = fine.solve(point, method="newton")
        assert reference.success
        assert rotor_power(SYSTEM.solve(point, method="newton")) == pytest.approx(rotor_power(reference), rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    "richer",
    [Fidelity(flap_modes=4), Fidelity(lag_modes=3), Fidelity(torsion_modes=2)],
    ids=["flap", "lag", "torsion"],
)
def test_three_flap_two_lag_and_one_torsion_modes_are_enough(richer):
    rich = trim_system(AIRCRAFT, richer)
    for point in SAMPLE:
        assert rotor_power(SYSTEM.solve(point, method="newton")) == pytest.approx(
            rotor_power(rich.solve(point, method="newton")), rel=2e-3
        )


STEPS = {
    "mass": 2.0,
    "altitude": 5.0,
    "isa_offset": 0.3,
    "speed": 0.04,
    "climb_angle": 4e-4,
    "turn_rate": 5e-4,
    "rotor_speed": 0.02,
    "twist": 5e-4,
    "ground_proximity": 1e-3,
    "cg_shift": 1e-3,
}


OUTPUTS = ("main_rotor_power", "tail_rotor_power", "induced_power", "tail_blade_loading")


def differences(point: dict[str, float], base: Solution, name: str, step: float) -> np.ndarray:
    """Fourth-order central differences of OUTPUTS of re-solved trims."""
    f = {}
    for k in (-2, -1, 1, 2):
        solution = SYSTEM.solve({**point, name: point[name] + k * step}, base, method="newton")
        f[k] = np.array([solution.outputs[output] for output in OUTPUTS])
    return (8 * (f[1] - f[-1]) - (f[2] - f[-2])) / (12 * step)


@pytest.mark.parametrize("point", SAMPLE, ids=NAMES)
def test_derivatives_equal_resolved_differences(point):
    """At the best of three steps: a long one leaves curvature, a short one the residual's tolerance."""
    base = SYSTEM.solve(point, method="newton")
    exact = SYSTEM.sensitivities(base)
    assert SYSTEM.smallest_singular_value(base) > 0.03
    for name, step in STEPS.items():
        if point["speed"] == 0 and name in ("speed", "climb_angle", "turn_rate"):
            continue  # at rest they have no direction
        if point[name] == 0 and name in ("turn_rate", "ground_proximity"):
            continue  # symmetric but for the tail rotor; and no slope far from the ground
        found = np.array([exact[output][name] for output in OUTPUTS])
        error = np.full(len(OUTPUTS), np.inf)
        for length in (step, step / 8, 4 * step):
            error = np.minimum(error, np.abs(differences(point, base, name, length) / found - 1))
            if np.max(error) <= 1e-5:
                break
        assert np.max(error) <= 1e-5, (name, error)


@pytest.mark.parametrize("point", SAMPLE, ids=NAMES)
def test_ipopt_and_newton_agree(point):
    newton, ipopt = (SYSTEM.solve(point, method=method) for method in ("newton", "ipopt"))
    assert newton.success and ipopt.success
    assert max(newton.residual_norm, ipopt.residual_norm) < TOLERANCE
    assert newton.values == pytest.approx(ipopt.values, abs=1e-7)
    assert rotor_power(newton) == pytest.approx(rotor_power(ipopt), rel=1e-8)


def test_neighbour_is_solved_without_a_new_jacobian():
    first = trimmed(30.0)
    second = SYSTEM.solve(parameters(30.5), first, method="newton")
    assert second.success and second.factorisation is first.factorisation
    assert rotor_power(second) == pytest.approx(rotor_power(trimmed(30.5)), rel=1e-8)


def test_guess_is_close_enough_to_need_few_iterations():
    for speed in (0.0, 15.0, 30.0, 60.0):
        guess, values = momentum_guess(AIRCRAFT, parameters(speed)), trimmed(speed).values
        assert guess["collective"] == pytest.approx(values["collective"], abs=0.06)
        assert trimmed(speed).iterations <= 15
