"""Tail rotor: momentum limit in hover, teetering, pitch-flap coupling, energy."""

import casadi as ca
import numpy as np
import pytest

import vrsopt.rotor.tail_rotor as module
from vrsopt.aircraft import TailRotor, load_aircraft
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
    """Inflow and teeter at given collective and speed."""
    x, p = ca.MX.sym("x", 3), ca.MX.sym("p", 2)
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
    )
    return ResidualSystem(
        name="tail",
        unknowns=(
            Unknown("inflow", "-", 0.05, start=0.03),
            Unknown("teeter cos", "rad", 0.05),
            Unknown("teeter sin", "rad", 0.05),
        ),
        parameters=(Named("collective", "rad"), Named("speed", "m/s")),
        residuals=(Named("inflow", scale=0.005), Named("cos", "N m", 200.0), Named("sin", "N m", 200.0)),
        outputs=(Named("thrust", "N"), Named("power", "W"), Named("drag", "N")),
        x=x,
        p=p,
        r=ca.vertcat(loads.inflow_residual, loads.teeter_residual),
        y=ca.vertcat(loads.thrust, loads.power, loads.drag),
    )


def solved(collective: float, speed: float, rotor: TailRotor = TAIL) -> Solution:
    solution = isolated(rotor).solve({"collective": collective, "speed": speed}, method="newton")
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


@pytest.mark.parametrize("speed", [0.0, 30.0, 60.0])
def test_shaft_power_and_drag_pay_for_induced_and_section_losses(speed, monkeypatch):
    """Energy: power + drag times speed = thrust times induced velocity + section drag. Teetering does no work."""
    solution = solved(0.12, speed)
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
    )
    weights = np.polynomial.legendre.leggauss(module.STATIONS)[1] / 2 * TAIL.radius * (1 - TAIL.root_cutout)
    dissipated = TAIL.blades / module.AZIMUTHS * float(np.sum(weights @ np.array(seen["loads"].dissipation)))
    induced = TAIL.induced_power_factor * solution.values["inflow"] * OMEGA * TAIL.radius * solution.outputs["thrust"]
    spent = solution.outputs["power"] + solution.outputs["drag"] * speed
    assert spent == pytest.approx(induced + dissipated, rel=1e-3)
