"""Velocity triangles: energy, textbook efficiency laws, the map form, and what the losses do."""

import math

import numpy as np
import pytest

from vrsopt.errors import InputError, NoSolutionError
from vrsopt.turboshaft.data import load_engine
from vrsopt.turboshaft.maps import turbine_work
from vrsopt.turboshaft.velocity_triangles import (
    ASSUMPTIONS,
    DEFAULT,
    SPEED,
    Duty,
    Fit,
    characteristics,
    fitted,
    triangles,
    work_over_design,
)

DUTY = Duty.of(load_engine())
# So hot that the density does not change: the laws of the textbooks are those of a constant density.
STIFF = Duty(work=200e3, inlet_temperature=1e6, heat_capacity=4e4, gas_constant=1e4)
LOSSLESS = {"loss_factor": 0.0, "positive_incidence_exponent": 0.0, "negative_incidence_exponent": 0.0}


def solved(duty, speed=1.0, spouting=1.0, *, stages=2, incidence="cosine", **changes):
    system = triangles(duty, stages=stages, incidence=incidence)
    parameters = {"speed": speed, "spouting_velocity": spouting, **DEFAULT, **changes}
    solution = system.solve(parameters, method="newton")
    assert solution.success, solution.message
    return solution


def design_angles(loading, reaction, flow_coefficient):
    """Nozzle and rotor exit angle [rad]."""
    return (
        math.atan((loading / 2 + 1 - reaction) / flow_coefficient),
        math.atan((loading / 2 + reaction) / flow_coefficient),
    )


@pytest.mark.parametrize("incidence", ["cosine", "moustapha"])
def test_the_design_point_is_a_root_with_no_incidence(incidence):
    solution = solved(DUTY, incidence=incidence)
    assert list(solution.values.values()) == pytest.approx([1.0] * 5, abs=1e-9)
    out = solution.outputs
    assert out["efficiency"] == pytest.approx(out["design_efficiency"], rel=1e-12)
    assert out["work"] == pytest.approx(DUTY.work, rel=1e-12)
    assert out["rotor_incidence"] == pytest.approx(0.0, abs=1e-12)
    assert math.degrees(out["exit_swirl"]) == pytest.approx(-math.degrees(math.atan(0.15 / 0.75)))
    assert out["blade_speed"] / SPEED == pytest.approx(0.080, abs=0.001)  # mean radius of a 250's wheel in m


@pytest.mark.parametrize("incidence", ["cosine", "moustapha"])
def test_euler_work_is_the_loss_of_total_enthalpy(incidence):
    rng = np.random.default_rng(2)
    for _ in range(5):
        changes = {item.name: rng.uniform(item.low, item.high) for item in ASSUMPTIONS}
        out = solved(DUTY, rng.uniform(0.6, 1.2), rng.uniform(0.7, 1.0), incidence=incidence, **changes).outputs
        assert out["work"] == pytest.approx(out["total_enthalpy_drop"], rel=1e-10)
        assert 0.3 < out["efficiency"] < 1.0


def test_euler_work_of_one_stage_from_its_triangles():
    solution = solved(DUTY, 0.8, 0.9, stages=1)
    blade = solution.outputs["blade_speed"]
    nozzle, rotor = design_angles(1.3, 0.5, 0.75)
    into, out = (0.75 * blade / 0.8 * solution.values[f"{row} 1"] for row in ("nozzle", "rotor"))
    assert solution.outputs["work"] == pytest.approx(blade * (into * math.tan(nozzle) + out * math.tan(rotor) - blade))


@pytest.mark.parametrize("loading", [1.0, 1.5, 2.0, 3.0])
def test_impulse_stage_without_losses(loading):
    """Total to static, blade speed over jet velocity u: 4 u (sin a - u), highest where u is half the sine."""
    lost = {"reaction": 0.0, "axial_head_lost": 1.0, "loading": loading, **LOSSLESS}
    out = solved(DUTY, stages=1, **lost).outputs
    ratio = out["blade_speed"] / math.sqrt(2 * out["isentropic_drop"])
    sine = math.sin(design_angles(loading, 0.0, 0.75)[0])
    assert out["efficiency"] == pytest.approx(4 * ratio * (sine - ratio), rel=1e-9)
    if loading == 2.0:  # no swirl behind it
        assert ratio == pytest.approx(sine / 2) and out["efficiency"] == pytest.approx(sine**2)


@pytest.mark.parametrize("speed", [0.6, 0.8, 1.0, 1.1, 1.3])
def test_half_reaction_stage_without_losses_at_any_speed(speed):
    """Parsons' stage, blade speed over nozzle exit velocity r: 2 r (2 sin a - r) / (1 - r^2 + 2 r sin a)."""
    solution = solved(STIFF, speed, stages=1, axial_head_lost=1.0, **LOSSLESS)
    sine = math.sin(design_angles(1.3, 0.5, 0.75)[0])
    design_speed = solution.outputs["blade_speed"] / speed
    jet = 0.75 * design_speed * solution.values["nozzle 1"] / math.sqrt(1 - sine**2)
    r = solution.outputs["blade_speed"] / jet
    law = 2 * r * (2 * sine - r) / (1 - r**2 + 2 * r * sine)
    assert solution.outputs["efficiency"] == pytest.approx(law, rel=1e-6)
    assert law <= 2 * sine**2 / (1 + sine**2) + 1e-12


def test_a_linear_torque_line_has_curvature_one():
    speed = np.linspace(0.6, 1.2, 13)
    for best in (1.0, None):
        fit = fitted(speed, np.ones(13), speed * (2.0 - speed), best=best)
        assert (fit.curvature, fit.best) == (pytest.approx(1.0), pytest.approx(1.0))
        assert fit.largest < 1e-12


def test_fit_finds_the_form_that_made_the_points():
    speed, spouting = (grid.ravel() for grid in np.meshgrid(np.linspace(0.6, 1.2, 7), [0.7, 0.85, 1.0]))
    made = Fit(0.7, 1.08, 0.0, 0.0)
    found = fitted(speed, spouting, work_over_design(made, speed, spouting), best=None)
    assert (found.curvature, found.best) == (pytest.approx(0.7), pytest.approx(1.08))
    held = fitted(speed, spouting, turbine_work(0.7, speed, spouting))
    assert held.curvature == pytest.approx(0.7) and held.largest < 1e-12


def test_losses_and_incidence_lower_the_efficiency():
    speed = np.array([0.7, 1.0, 1.3])
    cases = [
        LOSSLESS,
        {**LOSSLESS, "loss_factor": 1.0},
        {"positive_incidence_exponent": 1.0, "negative_incidence_exponent": 1.0},
        {"positive_incidence_exponent": 4.0, "negative_incidence_exponent": 4.0},
    ]
    efficiency = characteristics(DUTY, speed, np.ones(3), cases)["efficiency"]
    assert np.all(np.diff(efficiency[:2], axis=0) < -0.02)
    steeper = np.diff(efficiency[1:], axis=0)
    assert np.all(steeper[:, [0, 2]] < -0.005) and steeper[:, 1] == pytest.approx(np.zeros(2), abs=1e-12)


def test_too_fast_is_forgiven_more_than_too_slow_by_the_second_loss():
    out = characteristics(DUTY, np.array([0.7, 1.3]), np.ones(2), [{}], incidence="moustapha")
    slow, fast = (out["efficiency"] / out["design_efficiency"])[0]
    assert slow < 0.93 and fast > 0.99


def test_refusals():
    with pytest.raises(InputError, match="stages = 0: one or more"):
        triangles(DUTY, stages=0)
    with pytest.raises(NoSolutionError, match="velocity triangles: blading"):
        characteristics(DUTY, np.ones(1), np.array([2.5]), [{}])  # more than the enthalpy at the inlet
