"""Leishman-Beddoes dynamic stall with every state eliminated by exact periodic filters.

All states are first-order linear lags once their input is known, so that around one revolution each of them is one
periodic scan over the azimuths; nothing is marched in time. In flow that does not vary around the azimuth the loads are
those of the static section.

J. G. Leishman and T. S. Beddoes, A semi-empirical model for dynamic stall, J. American Helicopter Society 34 (1989);
M. H. Hansen, M. Gaunaa and H. Aa. Madsen, A Beddoes-Leishman type dynamic stall model, Riso-R-1354 (2004);
B. G. van der Wall and J. G. Leishman, J. American Helicopter Society 39 (1994), for the varying stream.

Each step between two scans is a function of few numbers at one instant, and each scan a short function of two series:
both give their derivatives cheaply, where one function of a whole station would cost three times as much.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import pi
from typing import Any

import casadi as ca

from vrsopt.atmosphere import Air
from vrsopt.rotor.airfoil import HIGHEST_LIFT_MACH, LOWEST_MACH, Airfoil, attachment, logistic, polynomial, smooth_clip
from vrsopt.rotor.periodic import driven, fed, lagged, rate_of_change
from vrsopt.rotor.section_loads import SectionLoads, flow_angles, on_grid, resolved

INDICIAL = ((0.3, 0.14), (0.7, 0.53))  # amplitudes and exponents of the circulatory step response
IMPULSIVE = 0.75  # of the theoretical time constant of the impulsive lift
GATE_WIDTH = 0.05  # of the normal force at which the vortex leaves
CLOCK_WIDTH = 0.5  # semi-chords over which the vortex stops being fed
REWIND, LEAK = 2.0, 60.0  # semi-chords: the vortex clock runs back when attached, and never beyond the leak
VORTEX_TRAVEL = 0.2  # of the chord: half of the way that the centre of the vortex lift moves aft
FALLING = 0.01  # lag of the pressure, as a sine, that marks a falling angle of attack


def unsteady_blade_loads(
    section: Airfoil,
    *,
    chord: float,
    velocities: tuple[Any, Any, Any],
    pitch: Any,
    pitch_rate: Any,
    rotor_speed: Any,
    air: Air,
    drag_level: Any,
    chord_recovery: float | None = None,
) -> SectionLoads:
    """Loads on an (E, N) grid of elements with dynamic stall; the N columns are uniform azimuths of one revolution.

    velocities: of the air relative to the quarter chord [m/s], (E, N) each: against its motion U_T, upward U_P, outward
    U_R. pitch [rad] and pitch_rate [rad/s], the section's nose-up rotation about the span: (E, N). chord_recovery:
    chord force of attached flow by that recovery factor instead of the section's drag. drag_level: drag coefficient of
    the section at zero incidence and low Mach number. chord [m], rotor_speed [rad/s].
    """
    felt = [value.T for value in (*velocities, pitch, pitch_rate)]  # (N, E): time runs down
    step = 2 * pi / (rotor_speed * pitch.shape[1])
    shared = [air.speed_of_sound, 2 * step / chord]
    model = DynamicStall(section, chord, chord_recovery)
    history = model.history(felt, shared, step)
    loads = on_grid(model.loads, [*felt, *history], [air.speed_of_sound, air.density, drag_level])
    return SectionLoads(*(value.T for value in loads))


@dataclass(frozen=True)
class Flow:
    """What the section feels at one instant; the properties are worked out where they are used.

    speed [m/s], sine and cosine of the angle of attack, speed of sound [m/s].
    """

    section: Airfoil
    speed: Any
    sine: Any
    cosine: Any
    speed_of_sound: Any

    @cached_property
    def mach(self) -> Any:
        """Mach number of the section."""
        return self.speed / self.speed_of_sound

    @cached_property
    def m(self) -> Any:
        """Mach number held inside the fit of lift and moment."""
        return smooth_clip(self.mach, LOWEST_MACH, HIGHEST_LIFT_MACH)

    @cached_property
    def beta_squared(self) -> Any:
        """Prandtl and Glauert's 1 - M^2, held above 0.2."""
        return smooth_clip(1 - self.mach**2, 0.2, 2.0)

    @cached_property
    def forward(self) -> Any:
        """Weight of forward flow; see :meth:`vrsopt.rotor.airfoil.Airfoil.forward`."""
        return self.section.forward(self.cosine)

    @cached_property
    def slope(self) -> Any:
        """Slope of the attached lift at this Mach number [1/rad]."""
        return polynomial(self.section.lift_slope, self.m)

    @cached_property
    def from_zero(self) -> Any:
        """Sine of the angle of attack from zero lift."""
        s0 = polynomial(self.section.zero_lift_sine, self.m)
        return self.sine * ca.sqrt(1 - s0**2) - self.cosine * s0

    @cached_property
    def separated(self) -> Any:
        """Lift coefficient of the separated flow; see :meth:`vrsopt.rotor.airfoil.Airfoil.separated`."""
        return self.section.separated(self.sine, self.cosine, self.m)

    def effective_sine(self, effective: Any) -> Any:
        """Sine of the angle from zero lift that goes with a lagged normal velocity."""
        return effective / ca.sqrt(self.speed**2 * (1 - self.from_zero**2) + effective**2)

    def impulsive(self, acceleration: Any, chord: float) -> Any:
        """Normal force coefficient of the apparent mass; ``acceleration`` [m/s2] in the middle of the chord.

        Non-circulatory time constant of the step in angle of attack: Leishman and Beddoes (1989).
        """
        growth = pi * self.m**2 * ca.sqrt(self.beta_squared) * sum(A * b for A, b in INDICIAL)
        return 4 * IMPULSIVE / (1 - self.m + growth) * chord * acceleration / self.speed**2

    def normal(self, pitch_rate: Any, chord: float) -> Any:
        """Velocity normal to the zero-lift line, three quarters of the chord aft."""
        return self.speed * self.from_zero + 0.5 * chord * pitch_rate

    def shedding(self, lag: Any) -> Any:
        """Gate of the vortex: open beyond the critical normal force, in forward flow."""
        force = self.slope * ca.sqrt(lag**2 + 1e-4)
        critical = polynomial(self.section.critical_normal_force, self.m)
        return self.forward * logistic((force - critical) / GATE_WIDTH)

    def passage(self) -> Any:
        """Time in which a vortex passes the chord, in half chords travelled (Leishman and Beddoes)."""
        return polynomial(self.section.vortex_passage, self.m)

    def travel(self, clock: Any) -> Any:
        """Way of the vortex over the chord, 0 to 1."""
        return smooth_clip(clock / self.passage(), 0.0, 1.0, 0.1)


@dataclass(frozen=True)
class DynamicStall:
    """The steps between the scans, for one section and chord."""

    section: Airfoil
    chord: float
    chord_recovery: float | None = None

    def history(self, felt: list[Any], shared: list[Any], step: Any) -> tuple[Any, ...]:
        """Lagged normal velocity, acceleration, lagged sine, weight of attached flow, vortex clock and vortex force,
        each (N, E); ``shared``: speed of sound and semi-chords per metre in one time step."""
        U_T, U_P, _, pitch, pitch_rate = felt
        speed, sine, cosine, middle, normal, *rates = on_grid(self._start, [U_T, U_P, pitch, pitch_rate], shared)
        flow = [speed, sine, cosine]
        effective = sum(A * lagged(rate, normal) for (A, _), rate in zip(INDICIAL, rates, strict=True))
        acceleration = rate_of_change(middle, step)
        rate, pressure = on_grid(self._pressure, [*flow, effective, acceleration], shared)
        lag = lagged(rate, pressure)
        clock = driven(*on_grid(self._clock, [*flow, lag], shared))
        weight = lagged(*on_grid(self._separation, [*flow, pressure, lag, clock], shared))
        vortex = fed(*on_grid(self._vortex, [*flow, effective, lag, weight, clock], shared))
        return effective, acceleration, lag, weight, clock, vortex

    def _start(self, state: Any, shared: Any) -> list[Any]:
        U_T, U_P, pitch, pitch_rate = ca.vertsplit(state)
        flow = Flow(self.section, *flow_angles(U_T, U_P, pitch), shared[0])
        semichords = shared[1] * flow.speed
        middle = flow.speed * flow.sine + 0.25 * self.chord * pitch_rate
        rates = [exponent * flow.beta_squared * semichords for _, exponent in INDICIAL]
        return [flow.speed, flow.sine, flow.cosine, middle, flow.normal(pitch_rate, self.chord), *rates]

    def _pressure(self, state: Any, shared: Any) -> list[Any]:
        flow, (effective, acceleration) = self._flow(state, shared)
        pressure = flow.effective_sine(effective) + flow.impulsive(acceleration, self.chord) / flow.slope
        return [shared[1] * flow.speed / polynomial(self.section.pressure_lag, flow.m), pressure]

    def _clock(self, state: Any, shared: Any) -> list[Any]:
        """The clock of the vortex runs in semi-chords while the gate is open, and back when it is closed."""
        flow, (lag,) = self._flow(state, shared)
        shedding = flow.shedding(lag)
        semichords = shared[1] * flow.speed
        return [semichords * ((1 - shedding) / REWIND + 1 / LEAK), semichords * shedding]

    def _separation(self, state: Any, shared: Any) -> list[Any]:
        """Behind a vortex and with a falling angle the flow comes back at a smaller angle than it left."""
        flow, (pressure, lag, clock) = self._flow(state, shared)
        side = lag / ca.sqrt(lag**2 + 1e-4)
        falling = (lag - pressure) * side
        falling = 0.5 * (falling + ca.sqrt(falling**2 + 1e-6)) - 0.5e-3
        shift = polynomial(self.section.reattachment_shift, flow.m) * side * falling / (falling + FALLING)
        angle = flow.sine + lag - flow.from_zero + shift * flow.travel(clock)
        rate = shared[1] * flow.speed / polynomial(self.section.separation_lag, flow.m)
        return [rate, attachment(angle, self.section.attached_limits(flow.m))]

    def _vortex(self, state: Any, shared: Any) -> list[Any]:
        """Fed by the lift that separation takes until the vortex has passed the chord."""
        flow, (effective, lag, weight, clock) = self._flow(state, shared)
        attached = flow.slope * flow.effective_sine(effective)
        taken = (1 - weight * flow.forward) * flow.forward * (attached - flow.separated)
        feed = flow.shedding(lag) * logistic((flow.passage() - clock) / CLOCK_WIDTH)
        return [shared[1] * flow.speed / polynomial(self.section.vortex_decay, flow.m), taken, feed]

    def _flow(self, state: Any, shared: Any) -> tuple[Flow, list[Any]]:
        speed, sine, cosine, *others = ca.vertsplit(state)
        return Flow(self.section, speed, sine, cosine, shared[0]), others

    def loads(self, state: Any, common: Any) -> list[Any]:
        """The loads of :class:`SectionLoads` of one element from what it feels and its history."""
        U_T, U_P, U_R, pitch, pitch_rate, *history = ca.vertsplit(state)
        speed_of_sound, density, drag_level = ca.vertsplit(common)
        flow = Flow(self.section, *flow_angles(U_T, U_P, pitch), speed_of_sound)
        coefficients = self._coefficients(flow, pitch_rate, history, drag_level)
        return list(resolved((U_T, U_P, U_R), flow.speed, coefficients, density=density, chord=self.chord))

    def _coefficients(self, flow: Flow, pitch_rate: Any, history: list[Any], drag_level: Any) -> tuple[Any, Any, Any]:
        effective, acceleration, lag, weight, clock, vortex = history
        section, sine, cosine, forward = self.section, flow.sine, flow.cosine, flow.forward
        weight *= forward
        impulsive = flow.impulsive(acceleration, self.chord)
        effective_sine = flow.effective_sine(effective)
        attached = flow.slope * effective_sine
        lift = weight * attached + (1 - weight) * flow.separated
        if self.chord_recovery is None:
            # At the angle of the lagged pressure; once suction is lost the force is normal to the chord.
            angle = sine + forward * (lag - flow.from_zero)
            lost = 1 - forward * attachment(angle, section.attached_limits(flow.m))
            table = (1 - lost) * flow.slope * lag + lost * section.separated(angle, cosine, flow.m)
            drag = section.drag(angle, flow.mach, drag_level) + lost * (lift * sine - table * angle)
            shed_wake = (flow.normal(pitch_rate, self.chord) - effective) / flow.speed
            drag += weight * attached * shed_wake
        else:
            # the root of Kirchhoff's separation point, where fully separated flow keeps a quarter of the attached lift
            suction = self.chord_recovery * attached * effective_sine * (ca.sqrt(1 + 3 * weight) - 1)
            normal = weight * attached + (1 - weight) * section.separated(sine, 1.0, flow.m)
            drag = section.drag(0.0, flow.mach, drag_level) + normal * flow.from_zero - suction * cosine
        moment = section.moment(sine, cosine, flow.m, weight, forward) - 0.25 * impulsive
        moment -= forward * (pi / 8) / ca.sqrt(flow.beta_squared) * pitch_rate * self.chord / flow.speed
        moment -= VORTEX_TRAVEL * (1 - ca.cos(pi * flow.travel(clock))) * vortex
        return lift + (vortex + impulsive) * cosine, drag + (vortex + impulsive) * sine, moment
