"""Equations of the elastic blade: against d'Alembert's principle on its material points, energy, textbook cases, and
an independent eigenproblem."""

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import eigh

from vrsopt.aircraft import load_aircraft
from vrsopt.rotor.blade import Beam, hermite
from vrsopt.rotor.blade_dynamics import BladeDynamics
from vrsopt.rotor.blade_equations import BladeEquations, Frame, RootPitch
from vrsopt.rotor.blade_frequencies import coupled_frequencies, crossings
from vrsopt.rotor.fidelity import Fidelity

ROTOR = load_aircraft("bo105").main_rotor
OMEGA = ROTOR.nominal_rotor_speed
MASS = 5.7  # kg/m
NO_DAMPING = {"structural_damping": 0.0, "structural_damping_lag": 0.0}
RADIUS, WEIGHT = 3.0 + 1.91 * np.polynomial.legendre.leggauss(12)[0], 1.91 * np.polynomial.legendre.leggauss(12)[1]


def rotor_with(*, precone: float = 2.5, **blade: object):
    return ROTOR.replaced(precone=precone, blade=ROTOR.blade.replaced(**blade))


def hinged_rotor(**change: object):
    """Blades that are rigid but for a soft root, so that the first modes are rotations about it."""
    soft, stiff = 3000.0, 1e8
    return ROTOR.replaced(
        **{"precone": 0.0, **change},
        blade=ROTOR.blade.replaced(
            station=(0.0, 0.04, 0.05, 4.91),
            mass_per_length=(MASS,) * 4,
            bending_stiffness_flap=(soft, soft, stiff, stiff),
            bending_stiffness_lag=(2 * soft, 2 * soft, stiff, stiff),
            torsional_stiffness=(5800.0,) * 4,
            polar_inertia=(0.03,) * 4,
            **NO_DAMPING,
        ),
    )


def random_state(equations: BladeEquations, instants: int = 1, seed: int = 3) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    size = np.repeat([0.6, 0.3, 0.3], [equations.flap.count, equations.lag.count, equations.torsion.count])
    return tuple(size[:, None] * OMEGA**order * rng.normal(size=(equations.size, instants)) for order in range(3))


def inertial_forces_of_material_points(rotor, equations, q, pitch, twist, omega, force) -> np.ndarray:
    """Virtual work of mass times (acceleration - gravity) of points of the blade, exact but for the tilt of the
    chord's spread: section mass at its centre (with the tilt of the section) and half of it at either end of a
    chordwise bar that carries the polar inertia."""
    beam = Beam(rotor.blade)
    r, dr = beam.radius, beam.weight
    time = ca.MX.sym("time")
    coordinates = ca.MX.sym("q", equations.size)

    def kinematics(modal, instant):
        w, v, p = equations.split(modal)
        precone = np.radians(rotor.precone)
        slope = ca.mtimes(equations.flap.at(r, 1), w) + precone
        lead_slope = ca.mtimes(equations.lag.at(r, 1), v)
        density = (slope**2 + lead_slope**2) / 2
        shortening = ca.mtimes(np.ones((len(r), 1)) @ dr[None] - beam.outboard, density)
        shortening += precone**2 / 2 * beam.nodes[0]
        root = pitch[0] + pitch[1] * instant + pitch[2] * instant**2 / 2
        theta = root - twist * (r / rotor.radius - 0.75) + ca.mtimes(equations.torsion.at(r), p)
        height = ca.mtimes(equations.flap.at(r), w) + precone * r
        lead = ca.mtimes(equations.lag.at(r), v)
        e, cos, sin = rotor.blade.mass_centre_offset, ca.cos(theta), ca.sin(theta)
        centre = (r - shortening - e * (lead_slope * cos + slope * sin), lead + e * cos, height + e * sin)
        mass = beam.mass_per_length * dr
        arm = np.interp(r, rotor.blade.station, rotor.blade.polar_inertia) * dr - mass * e**2
        return [(mass, centre), (arm, (0 * theta, cos, sin))]

    angle = OMEGA * time
    rotation = ca.vertcat(
        ca.horzcat(ca.cos(angle), -ca.sin(angle), 0), ca.horzcat(ca.sin(angle), ca.cos(angle), 0), ca.horzcat(0, 0, 1)
    )
    turn = np.array([[0, -omega[2], omega[1]], [omega[2], 0, -omega[0]], [-omega[1], omega[0], 0]])
    attitude = np.eye(3) + time * turn + time**2 / 2 * (turn @ turn)  # of the aircraft, to the second order in time
    moving = q[0] + q[1] * time + q[2] * time**2 / 2
    work = ca.MX.zeros(equations.size)
    for body, (mass, place) in enumerate(kinematics(moving, time)):
        path = ca.mtimes([attitude, rotation, ca.horzcat(*place).T])  # (3, n_p) inertial
        acceleration = ca.jacobian(ca.jacobian(ca.vec(path), time), time)
        if body == 0:
            acceleration += ca.vec(ca.repmat(ca.DM(force), 1, len(r)))
        virtual = ca.jacobian(ca.vec(ca.horzcat(*kinematics(coordinates, 0)[body][1]).T), coordinates)
        work += ca.mtimes(virtual.T, acceleration * np.repeat(mass, 3))
    value = ca.Function("work", [time, coordinates], [work])(0, q[0])
    return np.array(value).ravel()


@pytest.mark.parametrize("case", ["axis", "offset at rest", "offset and turning section"])
def test_inertial_terms_against_material_points(case):
    """All terms to the second order: with every small quantity times s, the difference falls with the third power.

    The Coriolis force of an offset mass centre is left out: that part is tested without rates of flap and lag.
    """
    twist, pitch = 0.14, (0.21, 0.0, -150.0) if case == "offset at rest" else (0.21, 3.0, -150.0)
    offset = 0.0 if case == "axis" else 0.1

    def forces(s: float) -> tuple[np.ndarray, np.ndarray]:
        rotor = rotor_with(
            precone=0.0 if case == "offset and turning section" else 20 * s,
            mass_centre_offset=offset * s,
            polar_inertia=tuple(50 * s * np.array(ROTOR.blade.polar_inertia)),
            **NO_DAMPING,
        )
        equations = BladeEquations(rotor, Fidelity(flap_modes=2, lag_modes=2, torsion_modes=1))
        q = [s * x for x in random_state(equations)]
        q[0][-1], q[1][-1], q[2][-1] = 0.1, 5.0, -100.0  # torsion need not be small
        if case == "offset at rest":
            q[1] *= 0
        if case == "offset and turning section":
            q[0][:-1], q[1][:-1] = 0, 0
        omega, force = s * np.array([3.0, -5.0, 4.0]), s**2 * np.array([500.0, 300.0, -400.0])
        frame = Frame(OMEGA, omega[2], omega[0], omega[1], force[2], force[1])
        arguments = {"pitch": RootPitch(*pitch), "twist": twist}
        whole = equations.imbalance(*(ca.DM(x) for x in q), frame=frame, **arguments)
        z = ca.SX.sym("z", equations.size)
        energy = equations.coupling_energy(z, pitch=pitch[0], twist=twist)
        elastic = ca.Function("elastic", [z], [ca.gradient(energy, z)])(q[0]) + equations.elastic @ q[0]
        exact = inertial_forces_of_material_points(rotor, equations, q, pitch, twist, omega, force)
        return np.array(whole - elastic).ravel(), exact

    model, exact = forces(0.01)
    coarse = model - exact
    fine = np.subtract(*forces(0.005))
    assert np.abs(coarse / exact).max() < 1e-3
    # the radial quadrature of the offset's terms leaves a little that falls with the first power
    assert np.linalg.norm(fine) < np.linalg.norm(coarse) / (7 if case == "axis" else 4)


def test_bending_forces_are_the_gradient_of_the_energy():
    equations = BladeEquations(rotor_with(precone=0.0, **NO_DAMPING), Fidelity())
    q = random_state(equations, instants=3)[0]
    z, still = ca.SX.sym("z", *q.shape), ca.DM.zeros(*q.shape)
    root = ca.DM([[0.1, 0.3, -0.2]])
    pitch, twist = RootPitch(root, 0 * root, 0 * root), 0.2
    energy = equations.coupling_energy(z, pitch=root, twist=twist) + ca.sum1(z * ca.mtimes(equations.elastic, z)) / 2
    gradient = ca.Function("gradient", [z], [ca.gradient(ca.sum2(energy), z)])(q)
    # at rest nothing but stiffness acts
    found = equations.imbalance(ca.DM(q), still, still, pitch=pitch, twist=twist, frame=Frame(0.0))
    assert np.array(found) == pytest.approx(np.array(gradient), abs=1e-9 * float(ca.mmax(ca.fabs(gradient))))


def test_load_vectors_of_precone_and_weight():
    """Integrals of m r phi and m phi by an independent fine quadrature."""
    equations = BladeEquations(ROTOR, Fidelity())
    edges = np.array(ROTOR.blade.station)
    points, weights = np.polynomial.legendre.leggauss(80)
    first, zeroth = np.zeros(3), np.zeros(3)
    for a, b in zip(edges[:-1], edges[1:], strict=True):
        r, dr = a + (points + 1) / 2 * (b - a), weights / 2 * (b - a)
        m = np.interp(r, edges, ROTOR.blade.mass_per_length)
        first += (m * r * dr) @ equations.flap.at(r)
        zeroth += (m * dr) @ equations.flap.at(r)
    assert equations.flap_moment == pytest.approx(first, rel=1e-6)
    assert equations.flap_weight == pytest.approx(zeroth, rel=1e-6)


def test_radial_quadrature_of_the_pitch_coupling():
    """Against the quadrature of the finite elements, forty times as many points."""
    equations = BladeEquations(ROTOR, Fidelity())
    beam = Beam(ROTOR.blade)
    r = beam.radius
    difference = np.interp(
        r, ROTOR.blade.station, np.subtract(ROTOR.blade.bending_stiffness_lag, ROTOR.blade.bending_stiffness_flap)
    )
    for seed in range(5):
        q = random_state(equations, seed=seed)[0]
        w, v, p = (np.array(x) for x in equations.split(ca.DM(q)))
        theta = 0.2 - 0.14 * (r / ROTOR.radius - 0.75) + (equations.torsion.at(r) @ p)[:, 0]
        w_rr, v_rr = (equations.flap.at(r, 2) @ w)[:, 0], (equations.lag.at(r, 2) @ v)[:, 0]
        terms = np.array([np.sin(theta) ** 2 * (w_rr**2 - v_rr**2), np.sin(2 * theta) * v_rr * w_rr])
        exact = (difference * beam.weight * terms).sum(axis=1) / 2
        found = float(equations.coupling_energy(ca.DM(q), pitch=0.2, twist=0.14))
        assert found == pytest.approx(exact.sum(), abs=2e-3 * np.abs(exact).sum())


@pytest.mark.parametrize("offset", [0.0, 0.05])
def test_conservative_forces_do_no_work_over_a_period(offset):
    rotor = rotor_with(mass_centre_offset=offset, **NO_DAMPING)
    equations = BladeEquations(rotor, Fidelity())
    psi = 2 * np.pi * np.arange(96) / 96
    rng = np.random.default_rng(8)
    size = np.array([0.4, 0.05, 0.02, 0.1, 0.02, 0.05])[:, None]
    q, rate, acceleration = np.zeros((3, 6, len(psi)))
    for k in range(4):
        a, b = size * rng.normal(size=(2, 6, 1))
        q += a * np.cos(k * psi) + b * np.sin(k * psi)
        rate += OMEGA * k * (b * np.cos(k * psi) - a * np.sin(k * psi))
        acceleration -= (OMEGA * k) ** 2 * (a * np.cos(k * psi) + b * np.sin(k * psi))
    row = ca.DM.ones(1, len(psi))
    forces = equations.imbalance(
        ca.DM(q),
        ca.DM(rate),
        ca.DM(acceleration),
        pitch=RootPitch(0.15 * row, 0 * row, 0 * row),
        twist=0.14,
        frame=Frame(OMEGA, force_up=9.81),
    )
    power = np.array(forces) * rate
    assert power.sum() == pytest.approx(0.0, abs=1e-11 * np.abs(power).sum())
    assert np.abs(power.sum(axis=1)).max() > 1e-3 * np.abs(power).sum()  # the modes do exchange it


def response(
    rotor, fidelity: Fidelity, *, hub_rate=(0.0, 0.0, 0.0), specific_force=(0.0, 0.0, 0.0), lift=0.0, pitch=0.0
):
    """Solved harmonic balance under a uniform lift [N/m]: modal coefficients (n, n_c), and the model."""
    dynamics = BladeDynamics(rotor, fidelity, RADIUS, WEIGHT)
    q = ca.MX.sym("q", len(dynamics.names), dynamics.harmonics.size)
    grid = ca.DM.ones(len(RADIUS), dynamics.harmonics.count)
    residual = dynamics.residual(
        q,
        up=lift * grid,
        along=0 * grid,
        moment=0 * grid,
        root_pitch=pitch * grid[0, :],
        twist=0.0,
        rotor_speed=OMEGA,
        hub_rate=hub_rate,
        specific_force=specific_force,
    )
    solver = ca.rootfinder("solver", "newton", {"x": ca.vec(q), "g": residual}, {"abstol": 1e-9})
    return np.array(ca.reshape(solver(x0=0)["x"], *q.shape)), dynamics


def test_gyroscopic_flapping_in_a_pitch_rate():
    """Rigid blade with a root spring: (nu^2 - 1) b_1 = -2 omega / Omega in phase with the rate seen from the blade."""
    q, dynamics = response(
        hinged_rotor(), Fidelity(flap_modes=1, lag_modes=0, torsion_modes=0), hub_rate=(0.2, 0.5, 0.0)
    )
    nu = dynamics.equations.flap.frequencies(OMEGA)[0] / OMEGA
    tip = 4.91 - 0.045  # from the equivalent hinge
    # with a hinge the virtual work is the integral of m r (r - hinge), not of m (r - hinge)^2
    hinge = 1 + 1.5 * 0.045 / tip
    expected = -2 * hinge * np.array([0.2, 0.5]) / OMEGA / (nu**2 - 1) * tip
    assert nu > 1.01
    assert q[0, 1:3] == pytest.approx(expected, rel=5e-3)
    assert np.abs(np.delete(q[0], [1, 2])).max() < 1e-9


def test_coning_of_a_rigid_blade():
    """nu^2 Omega^2 I b_0 = moment of the lift - moment of the weight - Omega^2 I precone."""
    fidelity = Fidelity(flap_modes=1, lag_modes=0, torsion_modes=0)
    q, dynamics = response(hinged_rotor(precone=2.5), fidelity, lift=900.0, specific_force=(0.0, 0.0, 9.81))
    nu = dynamics.equations.flap.frequencies(OMEGA)[0] / OMEGA
    tip, first, inertia = 4.91 - 0.045, MASS * 4.91**2 / 2, MASS * 4.91**3 / 3
    lift = 900.0 * 3.82 * (3.0 - 0.045)  # on the stations from 1.09 m to the tip
    coning = (lift - 9.81 * first - OMEGA**2 * inertia * np.radians(2.5)) / (nu**2 * OMEGA**2 * inertia)
    assert q[0, 0] == pytest.approx(coning * tip, rel=0.03)


def test_coriolis_moment_of_flapping_on_lag():
    """Rigid blade: lagwise moment 2 Omega I b b_t of a flap angle b, accelerating the blade that flaps up."""
    rotor = hinged_rotor()
    fidelity = Fidelity(flap_modes=1, lag_modes=1, torsion_modes=0)
    dynamics = BladeDynamics(rotor, fidelity, RADIUS, WEIGHT)
    zero, basis = ca.DM.zeros(len(RADIUS), dynamics.harmonics.count), dynamics.harmonics
    q = np.zeros((2, basis.size))
    q[0, :2] = 0.4, 0.2  # m at the tip
    residual = dynamics.residual(
        ca.DM(q),
        up=zero,
        along=zero,
        moment=zero,
        root_pitch=zero[0, :],
        twist=0.0,
        rotor_speed=OMEGA,
        hub_rate=(0.0, 0.0, 0.0),
        specific_force=(0.0, 0.0, 0.0),
    )
    lag = np.array(residual).ravel()[basis.size :]
    tip = 4.91 - 0.045
    inertia = MASS * tip**3 / 3
    expected = np.zeros(basis.size)  # of -2 Omega I b b_t / tip, with b = (0.4 + 0.2 cos psi) / tip
    expected[2] = 2 * OMEGA**2 * inertia * 0.4 * 0.2 / tip**3
    expected[4] = 2 * OMEGA**2 * inertia * 0.5 * 0.2**2 / tip**3
    assert lag == pytest.approx(expected, rel=5e-3, abs=1e-6)


def test_propeller_moment_and_inertia_of_cyclic_pitch():
    """-I Omega^2 sin theta cos theta per length; and at once per revolution it cancels the inertia of a small pitch."""
    dynamics = BladeDynamics(rotor_with(precone=0.0), Fidelity(flap_modes=0, lag_modes=0), RADIUS, WEIGHT)
    zero, basis = ca.DM.zeros(len(RADIUS), dynamics.harmonics.count), dynamics.harmonics

    def residual(root_pitch: np.ndarray) -> np.ndarray:
        value = dynamics.residual(
            ca.DM.zeros(1, basis.size),
            up=zero,
            along=zero,
            moment=zero,
            root_pitch=ca.DM(root_pitch).T,
            twist=0.0,
            rotor_speed=OMEGA,
            hub_rate=(0.0, 0.0, 0.0),
            specific_force=(0.0, 0.0, 0.0),
        )
        return np.array(value).ravel()

    # the first mode of a uniform shaft is a quarter sine: mean 2 / pi
    moment = 0.02946 * OMEGA**2 * (4.91 - 0.37) * 2 / np.pi
    assert residual(np.full(basis.count, 0.3))[0] == pytest.approx(moment * np.sin(0.3) * np.cos(0.3), rel=1e-4)
    cyclic = residual(0.01 * np.cos(basis.azimuth))
    assert np.abs(cyclic).max() < 1e-3 * 0.01 * moment
    twice = residual(0.01 * np.cos(2 * basis.azimuth))
    assert twice[3] == pytest.approx(-3 * 0.01 * moment, rel=1e-3)


def test_weight_in_the_plane_of_rotation():
    """A shaft on its side: the blade hangs back where it rises, forward where it falls."""
    fidelity = Fidelity(flap_modes=0, lag_modes=1, torsion_modes=0)
    q, dynamics = response(hinged_rotor(), fidelity, specific_force=(9.81, 0.0, 0.0))  # up is aft
    nu = dynamics.equations.lag.frequencies(OMEGA)[0] / OMEGA
    tip = 4.91 - 0.045
    # I Omega^2 (nu^2 - 1) zeta_s = + g S for the force -m g e_psi . e_aft = + m g sin psi
    expected = 9.81 * (MASS * tip**2 / 2) / (MASS * tip**3 / 3 * OMEGA**2 * (nu**2 - 1)) * tip
    assert q[0, 2] == pytest.approx(expected, rel=5e-3)


def test_offset_of_the_aerodynamic_centre():
    """Nose-up moment of the force normal to the chord, and nothing else."""
    zero = np.zeros((12, 36))
    results = []
    for offset in (0.0, 0.02):
        rotor = rotor_with(aerodynamic_centre_offset=offset)
        dynamics = BladeDynamics(rotor, Fidelity(), RADIUS, WEIGHT)
        residual = dynamics.residual(
            ca.DM.zeros(6, 9),
            up=ca.DM(zero + 1000.0),
            along=ca.DM(zero - 50.0),
            moment=ca.DM(zero),
            root_pitch=ca.DM(zero[:1] + 0.2),
            twist=0.0,
            rotor_speed=OMEGA,
            hub_rate=(0.0, 0.0, 0.0),
            specific_force=(0.0, 0.0, 9.81),
        )
        results.append(np.array(residual).reshape(6, 9))
    change = results[1] - results[0]
    shape = dynamics.equations.torsion.at(RADIUS)[:, 0] @ WEIGHT
    assert change[-1, 0] == pytest.approx(-0.02 * (1000.0 * np.cos(0.2) + 50.0 * np.sin(0.2)) * shape)
    assert np.abs(change.ravel()[:-9]).max() < 1e-9 and np.abs(change[-1, 1:]).max() < 1e-9


def test_motion_is_consistent():
    """Rates and slopes are the derivatives of the motion by time and radius."""
    q = 0.1 * np.random.default_rng(1).normal(size=(6, 9))
    motion = BladeDynamics(ROTOR, Fidelity(azimuths=72), RADIUS, WEIGHT).motion(ca.DM(q), 40.0)
    outer = BladeDynamics(ROTOR, Fidelity(azimuths=72), RADIUS + 1e-5, WEIGHT).motion(ca.DM(q), 40.0)
    for name in ("flap", "lag"):
        slope = (np.array(getattr(outer, name)) - np.array(getattr(motion, name))) / 1e-5
        assert np.array(getattr(motion, f"{name}_slope")) == pytest.approx(slope, rel=1e-4, abs=1e-5)
    for name in ("flap", "lag", "torsion"):
        spectrum = np.fft.fft(np.array(getattr(motion, name)), axis=1)
        rate = np.fft.ifft(1j * 40.0 * np.fft.fftfreq(72, 1 / 72) * spectrum, axis=1).real
        assert np.array(getattr(motion, f"{name}_rate")) == pytest.approx(rate, abs=1e-9)


@pytest.mark.parametrize("collective, twist", [(0.0, 0.0), (0.1, 0.14), (0.2, 0.25)])
def test_coupled_frequencies_against_a_twisted_beam(collective, twist):
    """Finite elements with both deflections at every node and the stiffness turned with the section."""
    rotor = rotor_with(precone=0.0)
    beam, blade = Beam(rotor.blade), rotor.blade
    r, dr = beam.radius, beam.weight
    curvature = hermite(beam.nodes, r, 2)
    flap, lag = (
        np.interp(r, blade.station, e) * dr for e in (blade.bending_stiffness_flap, blade.bending_stiffness_lag)
    )
    theta = collective - twist * (r / rotor.radius - 0.75)
    turned = np.concatenate([-np.sin(theta)[:, None] * curvature, np.cos(theta)[:, None] * curvature], axis=1)
    turned_edge = np.concatenate([np.cos(theta)[:, None] * curvature, np.sin(theta)[:, None] * curvature], axis=1)
    (mass, _, tension), (_, _, in_plane) = beam.matrices("flap"), beam.matrices("lag")
    free = np.r_[2 : len(mass), 2 + len(mass) : 2 * len(mass)]  # lag, then flap
    stiffness = (turned.T * flap) @ turned + (turned_edge.T * lag) @ turned_edge
    stiffness += OMEGA**2 * np.block([[in_plane, 0 * mass], [0 * mass, tension]])
    inertia = np.block([[mass, 0 * mass], [0 * mass, mass]])
    exact = np.sqrt(eigh(stiffness[np.ix_(free, free)], inertia[np.ix_(free, free)], eigvals_only=True)[:5])

    found = coupled_frequencies(rotor, Fidelity(flap_modes=6, lag_modes=5), OMEGA, collective, twist)
    assert np.sort(found[:11])[:5] == pytest.approx(exact, rel=5e-3)
    usual = coupled_frequencies(rotor, Fidelity(), OMEGA, collective, twist)
    assert np.sort(np.concatenate([usual[:2], usual[3:5]])) == pytest.approx(exact[:4], rel=1e-2)  # all but flap 3


def test_coupled_frequencies_of_the_flat_blade_are_those_of_its_modes():
    found = coupled_frequencies(rotor_with(precone=0.0, **NO_DAMPING), Fidelity(torsion_modes=2), OMEGA, 0.0, 0.0)
    equations = BladeEquations(ROTOR, Fidelity(torsion_modes=2))
    modes = np.concatenate([m.frequencies(OMEGA) for m in (equations.flap, equations.lag, equations.torsion)])
    assert found == pytest.approx(modes, rel=1e-6)


def test_crossings():
    """Where sqrt(a^2 + b Omega^2) = k Omega: at Omega = a / sqrt(k^2 - b)."""
    speed = np.linspace(30.0, 52.0, 45)
    frequencies = np.stack([np.full(45, 100.0), np.sqrt(150.0**2 + speed**2)], axis=1)
    found = crossings(("constant", "rising"), speed, frequencies)
    assert [(c.mode, c.order) for c in found] == [
        ("rising", 5),
        ("constant", 3),
        ("rising", 4),
        ("constant", 2),
    ]
    exact = [150 / np.sqrt(24), 100 / 3, 150 / np.sqrt(15), 50.0]
    assert [c.rotor_speed for c in found] == pytest.approx(exact, rel=1e-4)
