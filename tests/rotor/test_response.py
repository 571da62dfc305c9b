"""Main-rotor response: blade pitch and its signs, hover against blade elements and momentum, hub loads, energy."""

from typing import Any

import casadi as ca
import numpy as np
import pytest

from vrsopt.aircraft import load_aircraft
from vrsopt.atmosphere import GRAVITY, standard_air
from vrsopt.residual import Named, ResidualSystem, Unknown
from vrsopt.rotor.blade_frequencies import coupled_frequencies
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.rotor.response import Response, RotorModel, RotorState

ROTOR = load_aircraft("bo105").main_rotor
AIR = standard_air(0.0)
OMEGA = 44.4
DRAG_LEVEL = 0.0088
PLAIN = Fidelity(dynamic_stall=False, torsion_modes=0)
SLOPE = np.degrees(0.1212)  # 1/rad, of the deck at Mach 0.5, that of three quarters of the radius
LOCK = AIR.density * SLOPE * ROTOR.chord * ROTOR.radius**4 / 231.7


def state(model: RotorModel, blade: Any = None, *, uniform: float = 0.05, **changes: Any) -> RotorState:
    """The rotor at prescribed motion (none) and uniform inflow ratio."""
    inflow = np.zeros(model.inflow.size)
    inflow[model.inflow.names.index("inflow_cos_0_1")] = uniform / np.sqrt(3)
    shape = (len(model.blade.names), model.blade.harmonics.size)
    values: dict[str, Any] = {
        "collective": 0.15,
        "lateral_cyclic": 0.0,
        "longitudinal_cyclic": 0.0,
        "twist": ROTOR.twist,
        "rotor_speed": OMEGA,
        "wind": (0.0, 0.0, 0.0),
        "hub_rate": (0.0, 0.0, 0.0),
        "specific_force": (0.0, 0.0, GRAVITY),
        "ground_proximity": 0.0,
        "induced_power_factor": 1.0,
        "section_drag_level": DRAG_LEVEL,
        **changes,
    }
    return RotorState(
        blade=ca.DM(np.zeros(shape)) if blade is None else blade,
        inflow=ca.DM(inflow),
        air=AIR,
        **{name: ca.DM(value) for name, value in values.items()},
    )


def evaluate(model: RotorModel | None = None, blade: np.ndarray | None = None, **changes: Any) -> Response:
    """Response as numbers."""
    model = model or RotorModel(ROTOR)
    return model.response(state(model, None if blade is None else ca.DM(blade), **changes))


def free_response(fidelity: Fidelity | None = None, **settings: Any) -> dict[str, float]:
    """First flap harmonics [m] and hub loads of the free rotor at fixed controls and uniform inflow."""
    model = RotorModel(ROTOR, fidelity)
    names, count = model.blade.names, model.blade.harmonics.size
    size = len(names) * count
    x = ca.MX.sym("x", size)
    result = model.response(state(model, ca.reshape(x, count, len(names)).T, **settings))
    outputs = ca.vertcat(x[0], x[1], x[2], result.loads.force, result.loads.moment)
    labels = ("coning", "cos", "sin", "aft", "right", "up", "roll", "pitch", "yaw")
    system = ResidualSystem(
        name="free rotor",
        unknowns=tuple(Unknown(f"x{i}", "m", scale) for i, scale in enumerate(np.repeat(model.blade.scales, count))),
        parameters=(),
        residuals=tuple(
            Named(f"r{i}", "N", scale) for i, scale in enumerate(np.repeat(model.blade.equation_scales, count))
        ),
        outputs=tuple(Named(name) for name in labels),
        x=x,
        p=ca.MX.sym("p", 0),
        r=result.blade_residual,
        y=outputs,
    )
    solution = system.solve({}, method="newton")
    assert solution.success, solution.message
    return solution.outputs


def test_washout_lowers_the_tip_and_cyclic_acts_at_its_azimuth():
    model = RotorModel(ROTOR)
    given = {"collective": 0.2, "lateral_cyclic": 0.03, "longitudinal_cyclic": -0.05, "twist": 0.14}
    elements = model.elements(state(model, **given))
    pitch, x = np.array(elements.pitch), model.radius / ROTOR.radius
    assert np.all(pitch[-1] < pitch[0])
    assert pitch[0] - pitch[-1] == pytest.approx(np.full(36, 0.14 * (x[-1] - x[0])))
    at_three_quarters = pitch + 0.14 * (x[:, None] - 0.75)
    expected = 0.2 + 0.03 * np.cos(model.azimuth) - 0.05 * np.sin(model.azimuth)
    assert at_three_quarters[3] == pytest.approx(expected, rel=1e-12)
    assert np.array(elements.root_pitch).ravel() == pytest.approx(expected, rel=1e-12)
    rate = OMEGA * (-0.03 * np.sin(model.azimuth) - 0.05 * np.cos(model.azimuth))
    rate += OMEGA * np.radians(ROTOR.precone)  # a coned blade turns about its span
    assert np.array(elements.pitch_rate)[5] == pytest.approx(rate, rel=1e-12)


def test_hover_thrust_of_blade_elements():
    """Small angles, uniform inflow: thrust and power by a strip sum of the section written separately here."""
    collective, inflow = 0.15, 0.05
    edges = np.linspace(ROTOR.root_cutout, 1, 4001)
    x = 0.5 * (edges[1:] + edges[:-1])
    tip_speed = OMEGA * ROTOR.radius
    angle = collective - ROTOR.twist * (x - 0.75) - np.arctan(inflow / x)
    speed = tip_speed * np.hypot(x, inflow)
    mach = ca.DM(speed / AIR.speed_of_sound)
    coefficients = ROTOR.section.coefficients(ca.DM(np.sin(angle)), ca.DM(np.cos(angle)), mach, DRAG_LEVEL)
    c_l, c_d = (np.array(value).ravel() for value in coefficients[:2])
    q = 0.5 * AIR.density * speed**2 * ROTOR.chord * (edges[1] - edges[0]) * ROTOR.radius * ROTOR.blades
    phi = np.arctan(inflow / x)
    thrust = np.sum(q * (c_l * np.cos(phi) - c_d * np.sin(phi)))
    torque = np.sum(q * (c_l * np.sin(phi) + c_d * np.cos(phi)) * x * ROTOR.radius)
    flat = RotorModel(ROTOR.replaced(precone=0.0))
    loads = evaluate(flat, collective=collective, uniform=inflow).loads
    assert float(loads.force[2]) == pytest.approx(thrust, rel=1e-3)
    assert float(loads.power) == pytest.approx(torque * OMEGA, rel=1e-3)
    # precone takes the cosine of its angle from the thrust; the lift's small outward part is given back
    static = RotorModel(ROTOR, Fidelity(dynamic_stall=False))
    coned = evaluate(static, collective=collective, uniform=inflow).loads
    assert float(coned.force[2]) == pytest.approx(thrust, rel=2 * np.radians(ROTOR.precone) ** 2)


def test_flap_of_the_free_rotor_follows_the_swashplate_by_a_quarter_turn():
    """Pitch by sin(psi), largest on the right, raises the blade a quarter turn later, in front (cos(psi) = -1), nearly:
    the hingeless blade's first frequency of 1.12 per revolution makes the lag a little less than a quarter turn."""
    base, tilted = free_response(PLAIN), free_response(PLAIN, longitudinal_cyclic=0.02)
    cos, sin = tilted["cos"] - base["cos"], tilted["sin"] - base["sin"]
    assert cos < 0 and sin > 0 and abs(sin) < 0.5 * abs(cos)
    phase = np.degrees(np.arctan2(-cos, sin))
    expected = np.degrees(np.arctan2(LOCK / 8, 1.1155**2 - 1))  # rigid blade
    assert phase == pytest.approx(expected, abs=2.0)
    # torsion and the lag of the unsteady lift make it later
    base, tilted = free_response(), free_response(longitudinal_cyclic=0.02)
    later = np.degrees(np.arctan2(base["cos"] - tilted["cos"], tilted["sin"] - base["sin"]))
    assert phase + 2 < later < phase + 9


def test_hub_moment_of_a_tilted_disc_is_that_of_the_hingeless_hub():
    """M = N_b / 2 (nu^2 - 1) I_beta Omega^2 times the tilt, with the tilt of the equivalent rigid blade."""
    base, tilted = free_response(PLAIN), free_response(PLAIN, longitudinal_cyclic=0.02)
    equations = RotorModel(ROTOR).blade.equations
    frequency = coupled_frequencies(ROTOR, PLAIN, OMEGA, collective=0.15)[0]
    stiffness = (frequency**2 - OMEGA**2) * equations.flap.mass[0, 0]
    # first mode against the rigid blade: work of the modal stiffness, with the moment arm of the mode's inertia
    arm = equations.flap_moment[0] / equations.flap.mass[0, 0]
    change = np.hypot(tilted["pitch"] - base["pitch"], tilted["roll"] - base["roll"])
    tilt = np.hypot(tilted["cos"] - base["cos"], tilted["sin"] - base["sin"])
    assert change == pytest.approx(ROTOR.blades / 2 * stiffness * arm * tilt, rel=0.1)
    assert tilted["cos"] < base["cos"] and tilted["pitch"] > base["pitch"]  # disc tilted back: nose up


def test_a_pitching_hub_leaves_its_disc_behind():
    """Nose-up rate q: gyroscopic acceleration 2 Omega q r sin(psi) against the flap's stiffness and damping.

    Rigid blade: (nu^2 - 1) b_c + L b_s = L q / Omega and (nu^2 - 1) b_s - L b_c = -2 q / Omega, L the Lock number / 8.
    """
    rate = 0.2
    base, pitching = (free_response(PLAIN, hub_rate=(0.0, q, 0.0)) for q in (0.0, rate))
    stiffness = 1.1155**2 - 1
    tilt = np.linalg.solve([[stiffness, LOCK / 8], [-LOCK / 8, stiffness]], np.array([LOCK / 8, -2.0]) * rate / OMEGA)
    found = np.array([pitching["cos"] - base["cos"], pitching["sin"] - base["sin"]]) / ROTOR.radius
    assert found == pytest.approx(tilt, abs=0.08 * np.hypot(*tilt))
    assert found[0] > 0  # the back of the disc stays up while the nose rises
    assert pitching["pitch"] < base["pitch"] - 1000  # nose down: rate damping


def test_advancing_blade_makes_the_rotor_flap_back():
    """Forward flight at fixed controls: disc tilts back (down at psi = 0) and the hub force goes aft."""
    still, flying = free_response(), free_response(wind=(30.0, 0.0, 0.0))
    assert flying["cos"] < still["cos"] - 0.02
    assert flying["aft"] > still["aft"] + 100


def test_drag_of_a_rotor_without_lift_acts_aft_and_against_rotation():
    loads = evaluate(collective=-0.005, twist=0.0, uniform=0.0, wind=(60.0, 0.0, 0.0)).loads
    assert float(loads.force[0]) > 0 and float(loads.moment[2]) < 0
    assert float(loads.power) == pytest.approx(-OMEGA * float(loads.moment[2]))


@pytest.mark.parametrize("dynamic_stall", [False, True])
@pytest.mark.parametrize(
    "wind, hub_rate",
    [
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ((40.0, 0.0, -3.0), (0.0, 0.0, 0.0)),
        ((65.0, 5.0, 4.0), (0.0, 0.0, 0.0)),
        ((5.0, -20.0, 8.0), (0.0, 0.0, 0.0)),
        ((40.0, 0.0, -3.0), (0.1, -0.3, 0.2)),
    ],
)
def test_energy_is_conserved_at_any_prescribed_motion(wind, hub_rate, dynamic_stall):
    """Power of the air's torque = induced + profile - force . wind + moment . hub rate + work on the moving blade
    less that of the section's moment;
    the shaft also turns the angular momentum of a tilted disc with the hub."""
    model = RotorModel(ROTOR, Fidelity(dynamic_stall=dynamic_stall))
    blade = np.zeros((len(model.blade.names), model.blade.harmonics.size))
    blade[0, :3] = [0.1, -0.2, 0.15]  # flap
    blade[3, :3] = [-0.05, 0.02, 0.03]  # lag
    blade[5, :3] = [-0.02, 0.01, 0.015]  # torsion
    given = {"collective": 0.12, "lateral_cyclic": 0.02, "longitudinal_cyclic": -0.04, "wind": wind, "uniform": 0.03}
    moving = state(model, ca.DM(blade), **given, hub_rate=hub_rate)
    loads = model.response(moving).loads
    elements = model.elements(moving)
    section, motion = model.section_loads(elements, moving), elements.motion
    w_r, v_r = motion.flap_slope + np.radians(ROTOR.precone), motion.lag_slope
    along = section.along + v_r * section.outward - w_r * v_r * section.up
    up = section.up + w_r * section.outward
    work = up * motion.flap_rate + along * motion.lag_rate
    x, y, z = hub_rate
    about_span = x * model.cos + y * model.sin  # rotation about the deflected span that pitching does not count
    about_psi = y * model.cos - x * model.sin
    ones = ca.DM.ones(len(model.radius))
    rotation = ca.mtimes(ones, about_span) + v_r * ca.mtimes(ones, about_psi) + w_r * (OMEGA + z)
    work -= section.moment * rotation
    work = ROTOR.blades / len(model.azimuth) * float(ca.sum2(ca.mtimes(ca.DM(model.weight).T, work)))
    total = float(loads.induced_power + loads.profile_power - ca.dot(loads.force, ca.DM(wind)))
    total += float(ca.dot(loads.moment, ca.DM(hub_rate))) + work
    # second order in the deflections, and the section's regularised speed (2 m/s), leave parts in a thousand
    power = -OMEGA * float(loads.moment[2])
    assert total == pytest.approx(power, abs=2e-3 * (float(loads.profile_power) + abs(power)))
    tilt = -ROTOR.blades * OMEGA * model.blade.equations.flap_moment[0] * np.array([blade[0, 1], blade[0, 2]])
    turning = hub_rate[0] * tilt[1] - hub_rate[1] * tilt[0]
    assert float(loads.power) == pytest.approx(power + OMEGA * turning, rel=1e-9)


def test_ground_lowers_the_induced_velocity_only():
    model = RotorModel(ROTOR)
    far, near = (model.elements(state(model, ground_proximity=p)) for p in (0.0, 1.0))
    ratio = np.array(near.induced) / np.array(far.induced)
    assert ratio == pytest.approx(np.full(ratio.shape, (1 - 1 / 16) ** 1.5))
    assert np.array(near.tangential) == pytest.approx(np.array(far.tangential), rel=1e-2)


def test_fidelity_is_as_given():
    model = RotorModel(ROTOR, Fidelity(harmonics=2, azimuths=24, stations=8, flap_modes=2, lag_modes=1))
    assert model.blade.harmonics.size == 5 and model.radius.shape == (8,) and model.azimuth.shape == (24,)
    assert model.blade.names == ("flap1", "flap2", "lag1", "torsion1")
    assert float(np.sum(model.weight)) == pytest.approx(ROTOR.radius * (1 - ROTOR.root_cutout))


def test_flow_that_does_not_vary_around_the_azimuth_feels_no_dynamic_stall():
    """Without cone; a coned blade turns about its span, which is a camber."""
    flat = ROTOR.replaced(precone=0.0)
    unsteady, static = (evaluate(RotorModel(flat, Fidelity(dynamic_stall=on))).loads for on in (True, False))
    assert float(unsteady.power) == pytest.approx(float(static.power), rel=1e-9)
    assert float(unsteady.force[2]) == pytest.approx(float(static.force[2]), rel=1e-9)
    coned, static = (evaluate(RotorModel(ROTOR, Fidelity(dynamic_stall=on))).loads for on in (True, False))
    assert 1.005 < float(coned.force[2]) / float(static.force[2]) < 1.03  # half a chord of cone over three quarters R
