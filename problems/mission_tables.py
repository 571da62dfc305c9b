"""Tables of schedules: what each burns and emits, what saves what, how well surrogate and physics agree."""

from __future__ import annotations

from collections.abc import Iterator

from page_table import table

from vrsopt.report.account_tables import account_rows
from vrsopt.report.tables import label, verdict
from vrsopt.schedule.advantage import advantage
from vrsopt.schedule.comparison import Comparison

SHARES = (  # what is saved by what: words, schedule, and the one that it is compared with
    ("rotor set once for the mission", "constant", "nominal"),
    ("rotor changed in flight", "trajectory", "constant"),
    ("rotor, both", "trajectory", "nominal"),
    ("engine at its own best speed, rotor nominal", "nominal_variable_transmission", "nominal"),
    ("engine at its own best speed, rotor scheduled", "trajectory_variable_transmission", "trajectory"),
    ("both", "trajectory_variable_transmission", "nominal"),
    ("look-ahead over the mission", "trajectory", "pointwise_rate_limited"),
)


def schedule_table(results: dict[str, Comparison]) -> Iterator[str]:
    """Every schedule of every mission: what it burns and emits, on the surrogate and on the physics."""
    yield from table(
        ("mission", "schedule", "fuel kg", "%", "closed %", "physics kg", "%", "CO2 kg", "physics kg", "NOx g", "%")
        + ("physics g", "%", "verdict"),
        (
            (
                comparison.mission.name,
                label(name),
                f"{own['fuel_kg']:.2f}",
                f"{own['fuel_delta_percent']:+.2f}",
                number(own["fuel_delta_closed_percent"], "+.2f"),
                number(own["fuel_physics_kg"], ".2f"),
                number(own["fuel_physics_delta_percent"], "+.2f"),
                f"{own['co2_kg']:.1f}",
                number(own["co2_physics_kg"], ".1f"),
                f"{1e3 * own['nox_kg']:.0f}",
                f"{own['nox_delta_percent']:+.1f}",
                number(1e3 * own["nox_physics_kg"] if own["nox_physics_kg"] is not None else None, ".0f"),
                number(own["nox_physics_delta_percent"], "+.1f"),
                verdict(comparison.results[name]),
            )
            for comparison in results.values()
            for name, own in comparison.summary()["schedules"].items()
        ),
    )


def gap_table(results: dict[str, Comparison]) -> Iterator[str]:
    """Surrogate against physics, energy of the rotor, and what holds each schedule."""
    yield from table(
        ("mission", "schedule", "surrogate against physics %", "quadrature error %", "charged kJ", "credited kJ")
        + ("jumps kJ", "end-start kJ", "active, % of the time"),
        (
            (
                comparison.mission.name,
                row[0],
                f"{100 * (result.flight.fuel / result.physics.fuel - 1):+.3f}",
                f"{100 * max(one.quadrature_error / one.fuel for one in (result.flight, result.physics)):.3f}",
                *row[1:],
            )
            for comparison in results.values()
            for result, row in zip(comparison.results.values(), account_rows(comparison), strict=True)
        ),
    )


def contribution_table(results: dict[str, Comparison]) -> Iterator[str]:
    """Fuel saved by what, per cent of what it is compared with; on the surrogate and, in brackets, on the physics."""
    rows = []
    for words, own, other in SHARES:
        row = [words]
        for comparison in results.values():
            pair = [comparison.results[name] for name in (own, other)]
            surrogate = 100 * (pair[0].flight.fuel / pair[1].flight.fuel - 1)
            row.append(f"{surrogate:+.2f} ({100 * (pair[0].physics.fuel / pair[1].physics.fuel - 1):+.2f})")
        rows.append(row)
    yield from table(("fuel saved by", *(comparison.mission.name for comparison in results.values())), rows)
    for comparison in results.values():
        gained = advantage(comparison.results)
        yield f"- {comparison.mission.name}: {gained or 'no advantage stated: one of both schedules is not flyable'}"
    yield ""


def consistency_table(results: dict[str, Comparison]) -> Iterator[str]:
    """How well the trajectories on the physics are optima of the physics."""
    rows = []
    for comparison in results.values():
        found = comparison.consistent
        if found is None:
            rows.append((comparison.mission.name, *5 * ("-",), comparison.results["consistent"].message))
            continue
        last, before = found.optimality, found.surrogate
        rows.append(
            (
                comparison.mission.name,
                len(found.history),
                f"{100 * (found.trajectory.fuel / found.fuel_physics - 1):+.4f}",
                f"{before.at_stake:.4f}",
                f"{last.at_stake:.4f}",
                f"{100 * last.excess:+.2f}",
                found.message,
            )
        )
    yield from table(
        ("mission", "solves", "problem against physics %", "at stake before kg", "at stake kg", "largest excess %")
        + ("verdict",),
        rows,
    )


def step_table(results: dict[str, Comparison]) -> Iterator[str]:
    """How long each step took."""
    steps = dict.fromkeys(name for comparison in results.values() for name in comparison.steps)
    nothing = {"wall_s": 0.0, "cpu_s": 0.0}
    yield from table(
        ("step", *(f"{comparison.mission.name} s (of the processor)" for comparison in results.values())),
        (
            (step, *("{wall_s:.1f} ({cpu_s:.1f})".format(**one.steps.get(step, nothing)) for one in results.values()))
            for step in steps
        ),
    )


def number(value: float | None, form: str) -> str:
    """A figure of a summary, which may have none."""
    return "-" if value is None else format(value, form)
