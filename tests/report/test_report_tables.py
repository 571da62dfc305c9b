"""The table shows the numbers of the summary, and no percentage for what can not be flown."""

import math
import re
from dataclasses import replace

import pytest

from vrsopt.console import broken as failed_line
from vrsopt.report.emission_tables import (
    EMISSION_HEADINGS,
    PHASE_HEADINGS,
    between,
    emission_rows,
    label,
    number,
    phase_rows,
)
from vrsopt.report.tables import (
    HEADINGS,
    TASK_HEADINGS,
    footer,
    remarks,
    summary_rows,
    summary_text,
    task_rows,
)
from vrsopt.schedule.comparison import SIMPLIFICATIONS
from vrsopt.schedule.task_summary import task_figures


def test_numbers_are_those_of_the_summary(comparison):
    schedules = comparison.summary()["schedules"]
    rows = {row.name: row for row in summary_rows(comparison)}
    assert list(rows) == list(schedules)
    for name, figures in schedules.items():
        shown = rows[name].cells
        assert len(shown) == len(HEADINGS)
        expected = [
            figures["fuel_kg"],
            figures["fuel_delta_percent"],
            figures["fuel_delta_closed_percent"],
            figures["fuel_physics_kg"],
            figures["fuel_physics_delta_percent"],
            figures["co2_kg"],
        ]
        for text, value in zip(shown[1:7], expected, strict=True):
            assert abs(float(text) - value) <= 0.5 * 10 ** -len(text.partition(".")[2]) + 1e-9
        rate = figures["max_rotor_speed_rate_percent_s"]
        assert shown[7] == ("jumps" if rate is None else f"{rate:.2f}")
        assert float(shown[8]) == round(max(figures["time_on_limits_percent"].values()), 1)
        assert shown[9] == "flyable"
    assert rows["pointwise"].cells[7] == "jumps" and rows["trajectory"].cells[7] == "1.00"


def test_nox_is_shown_with_its_range(two_fits):
    for (name, result), row in zip(two_fits.results.items(), emission_rows(two_fits), strict=True):
        assert len(row) == len(EMISSION_HEADINGS)
        nox = 1e3 * result.emissions.total("nox")
        assert row[1] == f"{nox:.1f}" and row[2] == f"{nox:.1f} to {1.2 * nox:.1f}"
        change = result.changes["nox"]
        assert row[3] == f"{change:+.2f}"
        assert row[4] == ("+0.0" if name == "nominal" else f"{change:+.1f} to {change + 2:+.1f}")
        assert row[5] == f"{1e3 * result.physics.emissions.total('nox'):.1f}"
        assert row[8] == f"{1e3 * result.emissions.total('foca_nox'):.1f}"


def test_phases_add_up_to_the_mission(two_fits):
    *rows, total = phase_rows(two_fits, "trajectory")
    assert [row[0] for row in (*rows, total)] == [
        "idle *",
        "hover",
        "climb",
        "cruise",
        "loiter",
        "descent",
        "mission",
    ]
    assert all(len(row) == len(PHASE_HEADINGS) for row in rows)
    for column in (1, 2, 4, 5):
        assert abs(sum(float(row[column]) for row in rows) - float(total[column])) < 0.3
    result = two_fits.results["trajectory"]
    assert total[3] == f"{result.fuel_delta_percent:+.2f}" and total[7] == f"{result.changes['nox']:+.2f}"
    assert total[6] == f"{1e3 * result.emissions.total('nox'):.1f} to {1.2e3 * result.emissions.total('nox'):.1f}"
    assert {row[3] for row in phase_rows(two_fits, "nominal")} == {"-"}


def test_what_failed_is_named_beside_what_flies(broken):
    text = failed_line(broken)
    assert text.startswith("pointwise: torque 4.20 % over its limit at 90 s (cruise to quay)")
    assert "also not flyable: trajectory" in text
    assert text.endswith("; flyable: pointwise_rate_limited, prescribed, prescribed_rate_limited")


def test_tasks_have_their_share_of_time_distance_and_fuel(comparison):
    *rows, total = task_rows(comparison, "trajectory")
    assert all(len(row) == len(TASK_HEADINGS) for row in (*rows, total))
    assert [row[0] for row in rows] == [
        "idle",
        "ground idle",
        "hover",
        "vertical climb",
        "climb",
        "cruise",
        "descent",
        "loiter",
    ]
    assert total[0] == "mission" and total[2] == "100.0"
    for column in (1, 2, 3, 4, 5):
        assert abs(sum(float(row[column]) for row in rows) - float(total[column])) < 0.3
    loiter = rows[-1]
    circle = 2 * math.pi * 300.0
    assert loiter[1] == f"{circle / 40 / 60:.1f}" and loiter[3] == f"{circle / 1e3:.1f}"
    assert float(loiter[2]) == pytest.approx(100 * circle / 40 / comparison.profile.duration, abs=0.05)
    assert total[6] == f"{comparison.results['trajectory'].fuel_delta_percent:+.2f}"
    assert {row[6] for row in task_rows(comparison, "nominal")} == {"-"}


def test_tasks_are_figures_of_the_summary(comparison):
    figures = task_figures(comparison.profile, comparison.results)
    assert sum(one["share_percent"] for one in figures) == pytest.approx(100)
    assert sum(one["duration_s"] for one in figures) == pytest.approx(comparison.profile.duration)
    for name, result in comparison.results.items():
        assert sum(one["fuel_kg"][name] for one in figures) == pytest.approx(result.flight.fuel)
    assert {one["kind"]: one["distance_m"] for one in figures}["hover"] == 0.0


def test_the_prescribed_schedule_is_compared_with_the_modelled_one(comparison):
    lines = [line for line in remarks(comparison) if line.startswith("Prescribed")]
    own, base = (comparison.results[name] for name in ("prescribed", "pointwise"))
    difference, physics = own.flight.fuel - base.flight.fuel, own.physics.fuel - base.physics.fuel
    assert difference > 0.01
    assert lines[0] == (
        f"Prescribed climb and descent against pointwise: fuel {difference:+.3f} kg "
        f"({100 * difference / base.flight.fuel:+.2f} %) on the surrogate, {physics:+.3f} kg "
        f"({100 * physics / base.physics.fuel:+.2f} %) on the physics"
    )
    assert lines[1].startswith("Prescribed, rate limited against pointwise, rate limited: fuel +")
    without = {name: result for name, result in comparison.results.items() if name != "prescribed"}
    assert len([line for line in remarks(replace(comparison, results=without)) if line.startswith("Prescribed")]) == 1


def test_a_schedule_that_is_not_flyable_is_not_compared_with_the_prescribed(broken):
    expected = "Prescribed climb and descent against pointwise: not compared, one of them is not flyable"
    assert expected in remarks(broken)


def test_idle_is_marked_as_indicative(comparison):
    first, *others = comparison.profile.segments
    standing = replace(comparison, profile=type(comparison.profile)((replace(first, kind="idle"), *others)))
    assert phase_rows(standing, "nominal")[0][0] == "idle *"
    assert "*: NOx and CO at idle are indicative only" in re.sub(r"\s+", " ", summary_text(standing))


def test_a_schedule_that_breaks_a_limit_has_no_percentage(broken):
    rows = {row.name: row for row in summary_rows(broken)}
    assert rows["pointwise"].cells[2:4] == ("-", "-") and rows["pointwise"].cells[5] == "-"
    assert rows["pointwise"].verdict == "infeasible: torque 4.20 % over its limit at 90 s (cruise to quay)"
    assert rows["trajectory"].verdict == "failed: no physics at 3 s (hover): no trim"
    assert rows["trajectory"].cells[4] == "-"
    assert rows["pointwise_rate_limited"].verdict == "flyable"
    emissions = dict(zip(broken.results, emission_rows(broken), strict=True))
    assert emissions["pointwise"][3:5] == ("-", "-") and emissions["pointwise"][6] == "-"
    assert emissions["pointwise_rate_limited"][3] != "-"
    assert {row[3] for row in phase_rows(broken, "pointwise")} == {"-"}
    assert "pointwise: infeasible: torque 4.20 % over its limit at 90 s (cruise to quay)" in remarks(broken)


def test_text_holds_everything_at_80_columns(broken, with_variant):
    text = summary_text(broken, width=80)
    assert max(map(len, text.splitlines())) <= 80
    words = re.sub(r"\s+", " ", text)
    assert "infeasible: torque 4.20 % over its limit at 90 s" in words
    assert "Hop <über>" in words
    for word in ("schedule", "verdict", "flyable", "infeasible", "failed", "trajectory"):
        assert re.search(rf"(?m)(^|\s){word}(\s|$)", text), f"{word} is broken over two lines"
    words = re.sub(r"\s+", " ", summary_text(with_variant))
    assert words.startswith("Hop <über> ") and "Hop <über>, twist only" in words


def test_footer_names_mass_effort_accuracy_and_simplifications(comparison):
    summary, lines = comparison.summary(), footer(comparison)
    text = "\n".join(lines)
    for part in (
        f"{summary['takeoff_mass_kg']:.1f} kg",
        f"reserve {summary['reserve_kg']:.1f} kg",
        f"duration {summary['duration_s']:.0f} s",
        f"{summary['solver']['iterations']} iterations",
        SIMPLIFICATIONS[1:],
        f"{summary['foca']['landing_take_off']['total']['fuel_kg']:.1f} kg of fuel",
    ):
        assert part in text
    largest = max(abs(r.flight.fuel / r.physics.fuel - 1) for r in comparison.results.values())
    assert f"{100 * largest:.3f} %" in text


def test_a_nominal_schedule_that_is_not_flyable_is_pointed_out(broken):
    results = {**broken.results, "nominal": broken.results["pointwise"]}
    changed = type(broken)(**{**vars(broken), "results": results})
    assert any("nominal schedule itself is not flyable" in line for line in remarks(changed))
    assert not any("nominal schedule itself" in line for line in remarks(broken))


def test_numbers_as_text():
    assert (
        number(-0.004, "+.2f") == "+0.00" and number(-0.006, "+.2f") == "-0.01" and number(float("nan"), ".1f") == "-"
    )
    assert between((1.0, 3.0, 2.0), ".1f") == "1.0 to 3.0" and between((1.04, 1.01), ".1f") == "1.0"


def test_labels():
    assert label("pointwise_rate_limited") == "pointwise, rate limited"
    assert label("speed_only") == "speed only"
    assert label("prescribed") == "prescribed climb and descent"
