"""Main-rotor response: blade pitch and its signs, hover against blade elements and momentum, hub loads, energy."""

import casadi as ca
import numpy as np
import pytest

import vrsopt.rotor.response as response_module
from vrsopt.aircraft import MainRotor, load_aircraft
from vrsopt.atmosphere import standard_air
from vrsopt.residual import Named, ResidualSystem, Unknown
from vrsopt.rotor.response import Discretisation, Response, RotorModel, blade_loads

ROTOR = load_aircraft("bo105").main_rotor
AIR = standard_air(0.0)
OMEGA = 44.4


def evaluate(
    *,
    collective: float = 0.15,
    lateral: float = 0.0,
    longitudinal: float = 0.0,
    twist: float = ROTOR.twist,
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0),
    uniform: float = 0.05,
    flap: np.ndarray | None = None,
    rotor: MainRotor = ROTOR,
) -> Response:
    """The rotor at prescribed motion and uniform inflow ratio, as numbers."""
    model = RotorModel(rotor)
    cosine = np.zeros(len(model.inflow.cosine))
    cosine[0] = uniform / np.sqrt(3)
    return model.response(
        flap=ca.DM(np.zeros((3, model.coefficient_count)) if flap is None else flap),
        inflow=(ca.DM(cosine), ca.DM.zeros(len(model.inflow.sine))),
        collective=ca.DM(collective),
        lateral_cyclic=ca.DM(lateral),
        longitudinal_cyclic=ca.DM(longitudinal),
        twist=ca.DM(twist),
        rotor_speed=ca.DM(OMEGA),
        wind=ca.DM(wind),
        air=AIR,
        induced_power_factor=1.0,
        section_drag_level=0.0088,
    )


def free_response(**settings: float) -> dict[str, float]:
    """First flap harmonics [m] and hub loads of the free rotor at fixed controls and uniform inflow."""
    model = RotorModel(ROTOR)
    count = model.coefficient_count
    x, p = ca.MX.sym("x", 3 * count), ca.MX.sym("p", 0)
    cosine = np.zeros(len(model.inflow.cosine))
    cosine[0] = settings.get("uniform", 0.05) / np.sqrt(3)
    result = model.response(
        flap=ca.reshape(x, count, 3).T,
        inflow=(ca.MX(cosine), ca.MX.zeros(len(model.inflow.sine))),
        collective=settings.get("collective", 0.15),
        lateral_cyclic=settings.get("lateral", 0.0),
        longitudinal_cyclic=settings.get("longitudinal", 0.0),
        twist=ROTOR.twist,
        rotor_speed=OMEGA,
        wind=ca.DM([settings.get("aft", 0.0), 0.0, 0.0]),
        air=AIR,
        induced_power_factor=1.0,
        section_drag_level=0.0088,
    )
    loads = result.loads
    outputs = ca.vertcat(x[0], x[1], x[2], loads.force, loads.moment)
    names = ("coning", "cos", "sin", "aft", "right", "up", "roll", "pitch", "yaw")
    system = ResidualSystem(
        name="flapping",
        unknowns=tuple(Unknown(f"x{i}", "m", 0.1) for i in range(3 * count)),
        parameters=(),
        residuals=tuple(Named(f"r{i}", "N", 5000.0) for i in range(3 * count)),
        outputs=tuple(Named(name) for name in names),
        x=x,
        p=p,
        r=result.flap_residual,
        y=outputs,
    )
    solution = system.solve({}, method="newton")
    assert solution.success, solution.message
    return solution.outputs


def test_washout_lowers_the_tip_and_cyclic_acts_at_its_azimuth(monkeypatch):
    seen = {}

    def spy(*arguments, **keywords):
        seen["pitch"] = np.array(keywords["pitch"])
        return blade_loads(*arguments, **keywords)

    monkeypatch.setattr(response_module, "blade_loads", spy)
    evaluate(collective=0.2, lateral=0.03, longitudinal=-0.05, twist=0.14)
    pitch, model = seen["pitch"], RotorModel(ROTOR)
    assert np.all(pitch[-1] < pitch[0])
    x = model.radius / ROTOR.radius
    assert pitch[0] - pitch[-1] == pytest.approx(np.full(36, 0.14 * (x[-1] - x[0])))
    at_three_quarters = pitch + 0.14 * (x[:, None] - 0.75)
    assert at_three_quarters[3] == pytest.approx(
        0.2 + 0.03 * np.cos(model.azimuth) - 0.05 * np.sin(model.azimuth), rel=1e-12
    )


def test_hover_thrust_of_blade_elements():
    """Small angles, uniform inflow: C_T = sigma a / 2 (theta_75 / 3 - lambda / 2), by quadrature of the cut-out blade.

    The section's zero-lift angle, drag and compressibility enter by a strip sum written separately here.
    """
    collective, inflow = 0.15, 0.05
    edges = np.linspace(ROTOR.root_cutout, 1, 4001)
    x = 0.5 * (edges[1:] + edges[:-1])
    thrust = torque = 0.0
    tip_speed = OMEGA * ROTOR.radius
    angle = collective - ROTOR.twist * (x - 0.75) - np.arctan(inflow / x)
    speed = tip_speed * np.hypot(x, inflow)
    c_l, c_d = (
        np.array(ca.DM(v)).ravel()
        for v in ROTOR.section.coefficients(
            ca.DM(np.sin(angle)), ca.DM(np.cos(angle)), ca.DM(speed / AIR.speed_of_sound), 0.0088
        )
    )
    q = 0.5 * AIR.density * speed**2 * ROTOR.chord * (edges[1] - edges[0]) * ROTOR.radius * ROTOR.blades
    phi = np.arctan(inflow / x)
    thrust = np.sum(q * (c_l * np.cos(phi) - c_d * np.sin(phi)))
    torque = np.sum(q * (c_l * np.sin(phi) + c_d * np.cos(phi)) * x * ROTOR.radius)
    loads = evaluate(collective=collective, uniform=inflow).loads
    assert float(loads.force[2]) == pytest.approx(thrust, rel=1e-3)
    assert float(loads.power) == pytest.approx(torque * OMEGA, rel=1e-3)


def test_flap_of_the_free_rotor_follows_the_swashplate_by_a_quarter_turn():
    """Pitch by sin(psi), largest on the right, raises the blade a quarter turn later, in front (cos(psi) = -1), nearly:
    the hingeless blade's first frequency of 1.12 per revolution makes the lag a little less than a quarter turn."""
    base, tilted = free_response(), free_response(longitudinal=0.02)
    cos, sin = tilted["cos"] - base["cos"], tilted["sin"] - base["sin"]
    assert cos < 0 and sin > 0 and abs(sin) < 0.5 * abs(cos)
    phase = np.degrees(np.arctan2(-cos, sin))
    slope = np.degrees(0.1212)  # 1/rad, of the deck at Mach 0.5, that of three quarters of the radius
    lock_number = AIR.density * slope * ROTOR.chord * ROTOR.radius**4 / 231.7
    expected = np.degrees(np.arctan2(lock_number / 8, 1.1155**2 - 1))
    assert phase == pytest.approx(expected, abs=4.0)  # rigid-blade estimate of the flap phase


def test_hub_moment_of_a_tilted_disc_is_that_of_the_hingeless_hub():
    """M = N_b / 2 (nu^2 - 1) I_beta Omega^2 times the tilt, with the tilt of the equivalent rigid blade."""
    base, tilted = free_response(), free_response(longitudinal=0.02)
    modes = RotorModel(ROTOR).modes
    stiffness = modes.bending[0, 0] + OMEGA**2 * (modes.centrifugal[0, 0] - modes.mass[0, 0])
    # first mode against the rigid blade: work of the modal stiffness, with the moment arm of the mode's inertia
    arm = modes.precone[0] / modes.mass[0, 0]
    change = np.hypot(tilted["pitch"] - base["pitch"], tilted["roll"] - base["roll"])
    tilt = np.hypot(tilted["cos"] - base["cos"], tilted["sin"] - base["sin"])
    assert change == pytest.approx(ROTOR.blades / 2 * stiffness * arm * tilt, rel=0.1)
    # nose-down (about the right axis, hub frame x aft: forward disc tilt pitches the nose down = positive y)
    assert tilted["pitch"] - base["pitch"] > 0


def test_advancing_blade_makes_the_rotor_flap_back():
    """Forward flight at fixed controls: disc tilts back (down at psi = 0) and the hub force goes aft."""
    still, flying = free_response(), free_response(aft=30.0)
    assert flying["cos"] < still["cos"] - 0.02
    assert flying["aft"] > still["aft"] + 100


def test_drag_of_a_rotor_without_lift_acts_aft_and_against_rotation():
    loads = evaluate(collective=-0.005, twist=0.0, uniform=0.0, wind=(60.0, 0.0, 0.0)).loads
    assert float(loads.force[0]) > 0 and float(loads.moment[2]) < 0
    assert float(loads.power) == pytest.approx(-OMEGA * float(loads.moment[2]))


@pytest.mark.parametrize("wind", [(0.0, 0.0, 0.0), (40.0, 0.0, -3.0), (65.0, 5.0, 4.0), (5.0, -20.0, 8.0)])
def test_energy_is_conserved_at_any_prescribed_motion(wind):
    """Shaft power = induced + profile - force . wind + work on the flapping, whatever the flow.

    The flap here is the first harmonic of the first mode; its aerodynamic work follows from the generalised force.
    """
    flap = np.zeros((3, 9))
    flap[0, :3] = [0.1, -0.2, 0.15]
    result = evaluate(collective=0.12, lateral=0.02, longitudinal=-0.04, wind=wind, flap=flap, uniform=0.03)
    still = evaluate(collective=0.12, lateral=0.02, longitudinal=-0.04, wind=wind, flap=flap, uniform=0.03)
    loads = result.loads
    assert float(still.loads.power) == float(loads.power)
    # residual = inertia + damping + stiffness - load: the load's first harmonics by adding the structural part back
    model = RotorModel(ROTOR)
    modes, coefficients = model.modes, flap[0]
    frequency = modes.frequencies(ROTOR.nominal_rotor_speed)[0]
    residual = np.array(result.flap_residual).ravel()[:9]
    harmonic = np.array([0.0, 1.0, 1.0])
    structural = (
        modes.bending[0, 0] + OMEGA**2 * (modes.centrifugal[0, 0] - harmonic**2 * modes.mass[0, 0])
    ) * coefficients[:3]
    rate = OMEGA * np.array([0.0, coefficients[2], -coefficients[1]])
    structural += 2 * ROTOR.blade.structural_damping * frequency * modes.mass[0, 0] * rate
    load = structural[1:] - residual[1:3]  # cos, sin; precone and weight have no harmonics
    work = ROTOR.blades / 2 * float(load @ rate[1:])
    total = float(loads.induced_power + loads.profile_power - ca.dot(loads.force, ca.DM(wind))) + work
    # the induced part and the section's regularised speed (2 m/s) leave parts in ten thousand
    assert total == pytest.approx(float(loads.power), abs=2e-3 * float(loads.profile_power + abs(loads.power)))


def test_discretisation_is_as_given():
    model = RotorModel(ROTOR, Discretisation(harmonics=2, azimuths=24, stations=8, flap_modes=2))
    assert model.coefficient_count == 5 and model.radius.shape == (8,) and model.azimuth.shape == (24,)
    assert float(np.sum(model.weight)) == pytest.approx(ROTOR.radius * (1 - ROTOR.root_cutout))
    # d/dpsi of cos psi is -sin psi
    assert model.rate[1] == pytest.approx(-model.fourier[2]) and model.rate[4] == pytest.approx(2 * model.fourier[3])
