"""Tail rotor: momentum limit in hover, teetering, pitch-flap coupling, energy."""

import casadi as ca
import numpy as np
import pytest

import vrsopt.rotor.tail_rotor as module
from vrsopt.aircraft import TailRotor, load_aircraft
from vrsopt.airframe import airframe_loads, local_velocity
from vrsopt.atmosphere import standard_air
from vrsopt.residual import Named, ResidualSystem, Solution, Unknown
from vrsopt.rotor.section_loads import blade_loads
from vrsopt.rotor.tail_rotor import symmetric_section, tail_rotor_loads

AIRCRAFT = load_aircraft("bo105")
TAIL = AIRCRAFT.tail_rotor
SECTION = symmetric_section(AIRCRAFT.main_rotor.section)
AIR = standard_air(0.0)
OMEGA = 44.4 * TAIL.speed_ratio


def isolated(rotor: TailRotor = TAIL) -> ResidualSystem:
    """Inflow and teeter at given collective, speed and axial speed."""
    x, p = ca.MX.sym("x", 3), ca.MX.sym("p", 3)
    loads = tail_rotor_loads(
        rotor,
        SECTION,
        collective=p[0],
        inflow=x[0],
        teeter=(x[1], x[2]),
        rotor_speed=OMEGA,
        speed=p[1],
        air=AIR,
        drag_level=0.0088,
        axial_speed=p[2],
    )
    return ResidualSystem(
        name="tail",
        unknowns=(
            Unknown("inflow", "-", 0.05, start=0.03),
            Unknown("teeter cos", "rad", 0.05),
            Unknown("teeter sin", "rad", 0.05),
        ),
        parameters=(Named("collective", "rad"), Named("speed", "m/s"), Named("axial speed", "m/s")),
        residuals=(Named("inflow", scale=0.005), Named("cos", "N m", 200.0), Named("sin", "N m", 200.0)),
        outputs=(Named("thrust", "N"), Named("power", "W"), Named("drag", "N"), Named("loading")),
        x=x,
        p=p,
        r=ca.vertcat(loads.inflow_residual, loads.teeter_residual),
        y=ca.vertcat(loads.thrust, loads.power, loads.drag, loads.thrust_over_solidity),
    )


def solved(collective: float, speed: float, rotor: TailRotor = TAIL, *, axial_speed: float = 0.0) -> Solution:
    parameters = {"collective": collective, "speed": speed, "axial speed": axial_speed}
    solution = isolated(rotor).solve(parameters, method="newton")
    assert solution.success, solution.message
    return solution


def test_hover_thrust_and_power_obey_momentum_theory():
    solution = solved(0.15, 0.0)
    thrust, power = solution.outputs["thrust"], solution.outputs["power"]
    area, tip_speed = np.pi * TAIL.radius**2, OMEGA * TAIL.radius
    assert solution.values["inflow"] * tip_speed == pytest.approx(np.sqrt(thrust / (2 * AIR.density * area)), rel=1e-3)
    ideal = thrust**1.5 / np.sqrt(2 * AIR.density * area)
    solidity = TAIL.blade_area / area
    least_drag = solidity * 0.0085 / 8 * AIR.density * area * tip_speed**3
    assert TAIL.induced_power_factor * ideal + 0.9 * least_drag < power < 1.25 * ideal + 2.5 * least_drag
    assert solution.values["teeter cos"] == pytest.approx(0.0, abs=1e-9)
    assert solution.outputs["drag"] == pytest.approx(0.0, abs=1e-6)


def test_fast_flight_inflow_is_that_of_a_wing():
    solution = solved(0.1, 60.0)
    induced = solution.values["inflow"] * OMEGA * TAIL.radius
    mass_flow = AIR.density * np.pi * TAIL.radius**2 * np.hypot(60.0, induced)
    assert 2 * mass_flow * induced == pytest.approx(solution.outputs["thrust"], rel=1e-5)


def test_thrust_and_drag_grow_with_collective():
    low, high = solved(0.05, 40.0).outputs, solved(0.09, 40.0).outputs
    assert high["thrust"] > low["thrust"] > 0 and high["drag"] > low["drag"] > 0 and high["power"] > low["power"] > 0


def test_pitch_flap_coupling_of_the_stable_sense_reduces_flapping():
    def flapping(delta3: float) -> float:
        values = solved(0.1, 50.0, TAIL.replaced(delta3=delta3)).values
        return float(np.hypot(values["teeter cos"], values["teeter sin"]))

    assert flapping(-45.0) < flapping(0.0)
    # coupling tan(45 deg) shares the flapping between both harmonics: down by the square root of two, nearly
    assert flapping(0.0) / flapping(-45.0) == pytest.approx(np.sqrt(2), rel=0.1)


@pytest.mark.parametrize("speed, axial_speed", [(0.0, 0.0), (30.0, 0.0), (60.0, 0.0), (0.0, 3.0), (30.0, -3.0)])
def test_shaft_power_and_drag_pay_for_induced_and_section_losses(speed, axial_speed, monkeypatch):
    """Energy: power + drag times speed = thrust times (induced + axial velocity) + section drag. Teetering does no
    work."""
    solution = solved(0.12, speed, axial_speed=axial_speed)
    seen = {}

    def spy(*arguments, **keywords):
        seen["loads"] = blade_loads(*arguments, **keywords)
        return seen["loads"]

    monkeypatch.setattr(module, "blade_loads", spy)
    tail_rotor_loads(
        TAIL,
        SECTION,
        collective=ca.DM(0.12),
        inflow=ca.DM(solution.values["inflow"]),
        teeter=(ca.DM(solution.values["teeter cos"]), ca.DM(solution.values["teeter sin"])),
        rotor_speed=OMEGA,
        speed=speed,
        air=AIR,
        drag_level=0.0088,
        axial_speed=axial_speed,
    )
    weights = np.polynomial.legendre.leggauss(module.STATIONS)[1] / 2 * TAIL.radius * (1 - TAIL.root_cutout)
    dissipated = TAIL.blades / module.AZIMUTHS * float(np.sum(weights @ np.array(seen["loads"].dissipation)))
    through = TAIL.induced_power_factor * solution.values["inflow"] * OMEGA * TAIL.radius + axial_speed
    spent = solution.outputs["power"] + solution.outputs["drag"] * speed
    assert spent == pytest.approx(through * solution.outputs["thrust"] + dissipated, rel=1e-3)


@pytest.mark.parametrize("axial_speed", [6.0, -3.0])
def test_axial_flow_obeys_momentum_theory(axial_speed):
    """Climb and slow descent of a hovering rotor: T = 2 rho A v_i (v_i + V_c)."""
    solution = solved(0.15, 0.0, axial_speed=axial_speed)
    induced = solution.values["inflow"] * OMEGA * TAIL.radius
    thrust = 2 * AIR.density * np.pi * TAIL.radius**2 * induced * (induced + axial_speed)
    assert solution.outputs["thrust"] == pytest.approx(thrust, rel=2e-3)


@pytest.mark.parametrize("speed", [0.0, 30.0, 60.0])
def test_a_yaw_to_the_right_pushes_the_tail_back(speed):
    """The hub goes left, the air comes to the disc with the thrust, angles of attack and thrust rise: damping."""
    hub = (-TAIL.behind_cg, 0.0, -TAIL.above_cg)
    along, axial, _ = local_velocity((speed, 0.0, 0.0), (0.0, 0.0, 0.3), hub)
    assert axial == pytest.approx(-0.3 * TAIL.behind_cg) and along == speed
    steady, yawing = solved(0.1, speed), solved(0.1, speed, axial_speed=axial)
    gain = yawing.outputs["thrust"] - steady.outputs["thrust"]
    assert 0 < gain < 0.6 * steady.outputs["thrust"]


@pytest.mark.parametrize("speed", [20.0, 40.0, 60.0])
def test_tail_rotor_and_fin_together_turn_the_aircraft_into_the_wind(speed):
    """Yawing moment by lateral velocity: N_v > 0 of tail rotor, fin and fuselage, the tail rotor's share needed."""
    less, more = (solved(0.06, speed, axial_speed=v).outputs["thrust"] for v in (-0.5, 0.5))
    tail_rotor = -TAIL.behind_cg * TAIL.fin_blockage * (more - less)
    v = ca.MX.sym("v")
    frame = airframe_loads(AIRCRAFT, velocity=(speed, v, 0.0), air=AIR, downwash=0.0, parasite_area=1.4)
    airframe = float(ca.Function("N_v", [v], [ca.jacobian(frame.moment[2], v)])(0.0))
    assert airframe < 0 < airframe + tail_rotor


@pytest.mark.parametrize("speed", [0.0, 30.0, 60.0])
def test_thrust_follows_the_collective_up_to_the_blade_loading_limit(speed):
    limit = AIRCRAFT.blade_loading_limit
    table = np.interp(speed / (OMEGA * TAIL.radius), limit.advance_ratio, limit.thrust_over_solidity)
    largest = limit.tail_rotor_fraction * float(table)
    degrees = np.arange(2.0, 24.0, 1.0)
    points: list[Solution] = []
    for angle in degrees:  # each from its neighbour: a stalled rotor is far from the start
        parameters = {"collective": np.radians(angle), "speed": speed, "axial speed": 0.0}
        points.append(isolated().solve(parameters, points[-1] if points else None, method="newton"))
        assert points[-1].success, points[-1].message
    loading = np.array([point.outputs["loading"] for point in points])
    middle, slope = (loading[1:] + loading[:-1]) / 2, np.diff(loading)
    attached = float(np.interp(0.5 * largest, middle, slope))
    assert np.min(slope[(middle > 0.5 * largest) & (middle < 0.9 * largest)]) > 0.6 * attached
    assert np.max(slope[middle > 1.15 * largest]) < 0.6 * attached
    assert loading[-1] > 1.15 * largest  # the sweep goes far enough for the line above to mean something
