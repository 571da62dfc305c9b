"""What the page says: failures first, then where the saving comes from, how it was found, checked, and from what."""

from dataclasses import replace

import numpy as np
import pytest

from vrsopt.aircraft import load_aircraft
from vrsopt.report.dataset import result_dataset
from vrsopt.report.markup import Bad
from vrsopt.report.page import report_page
from vrsopt.report.physics_tables import physics_rows, usage_rows
from vrsopt.report.saving_plot import MOST_TASKS, saving_figure
from vrsopt.report.saving_tables import (
    CAUSE_HEADINGS,
    SAVING_HEADINGS,
    TASK_SAVING_HEADINGS,
    cause_rows,
    flyable_savings,
    saving_rows,
    task_saving_rows,
)
from vrsopt.report.solver_tables import arc_rows, solver_rows, step_rows
from vrsopt.report.sources import numbers, setting_rows
from vrsopt.report.words import foremost_flyable, summary_sentences
from vrsopt.schedule.bands import ForbiddenBand


def column(rows, place):
    return [float(row[place]) for row in rows]


def only(comparison, *names):
    return replace(comparison, results={name: comparison.results[name] for name in names})


def page(comparison):
    pictures = {key: {} for key in ("", *comparison.variants)}
    return report_page(comparison, pictures=pictures, mission_text="", record={})


# -- what is known first -----------------------------------------------------------------------------------------------


def test_the_summary_says_what_is_saved_by_what_where_and_how_it_is_checked(comparison):
    words = summary_sentences(comparison)
    assert not any(isinstance(one, Bad) for one in words)
    base, own = (comparison.results[name].physics.fuel for name in ("nominal", "trajectory"))
    assert f'"trajectory" the mission burns {100 * (1 - own / base):.1f} % less fuel' in words[0]
    assert f"{own:.2f} kg against {base:.2f} kg" in words[0]
    assert words[1].startswith("How sure that is")
    assert "less drag of the main rotor's blades" in words[2] and "saved" in words[2]
    assert "cruise to quay" in words[3]
    assert words[4].startswith("Active limits")
    apart = 100 * abs(comparison.results["trajectory"].flight.fuel / own - 1)
    assert f"within {apart:.3f} % of the surrogate's" in words[5]
    assert "NOx changes by -" in words[6]


def test_failures_come_first(broken, with_variant):
    words = summary_sentences(broken)
    assert [isinstance(one, Bad) for one in words[:3]] == [True, True, False]
    assert "pointwise: infeasible: torque" in words[0]
    assert "trajectory: failed: no physics at 3 s (hover): no trim" in words[1]
    assert '"pointwise, rate limited"' in words[2]  # the next that is flyable
    assert foremost_flyable(broken) == "pointwise_rate_limited"
    text = page(broken)
    assert 0 < text.index('<li class="bad">') < text.index("<nav>")
    failed = replace(with_variant, variants={"twist_only": broken})
    assert sum(isinstance(one, Bad) for one in summary_sentences(failed)) == 2
    assert summary_sentences(with_variant)[-1].startswith("By itself, twist saves")


def test_nothing_but_nominal_saves_nothing(comparison, broken):
    alone = only(comparison, "nominal")
    alone = replace(alone, trajectory=None)
    words = summary_sentences(alone)
    assert len(words) == 1 and "Only the nominal schedule was flown" in words[0] and not isinstance(words[0], Bad)
    assert saving_figure(alone) is None and saving_rows(alone) == []
    assert 'id="saving"' not in page(alone) and 'id="physics"' in page(alone)
    failed = only(broken, "nominal", "trajectory")
    assert isinstance(summary_sentences(failed)[-1], Bad) and "nothing is saved" in summary_sentences(failed)[-1]
    assert saving_figure(failed) is None and saving_rows(failed)[0][1:] == ("-",) * (len(SAVING_HEADINGS) - 1)
    assert 'id="saving"' in page(failed)
    base = comparison.results["nominal"]
    unsolved = replace(base.physics, success=False, fuel=np.nan, shaft_power=None, message="no physics at 3 s (hover)")
    lost = replace(comparison, results={**comparison.results, "nominal": replace(base, physics=unsolved)})
    words = summary_sentences(lost)
    assert "no physics at 3 s" in words[0] and words[1].startswith("Nothing to compare with") and len(words) == 2
    assert 'id="saving"' in page(lost)


# -- where the saving comes from ---------------------------------------------------------------------------------------


def test_causes_and_tasks_add_up_to_what_is_saved(comparison):
    for row in saving_rows(comparison):
        assert len(row) == len(SAVING_HEADINGS)
        assert sum(column([row[3:]], i)[0] for i in range(len(row) - 3)) == pytest.approx(float(row[2]), abs=0.04)
    for name in flyable_savings(comparison):
        saved = comparison.results["nominal"].physics.fuel - comparison.results[name].physics.fuel
        causes, tasks = cause_rows(comparison, name), task_saving_rows(comparison, name)
        assert {len(row) for row in causes} == {len(CAUSE_HEADINGS)}
        assert {len(row) for row in tasks} == {len(TASK_SAVING_HEADINGS)}
        assert float(causes[-1][1]) == pytest.approx(saved, abs=6e-4)
        assert sum(column(causes[:-1], 1)) == pytest.approx(saved, abs=5e-3)
        for place in (3, 4, *range(7, len(TASK_SAVING_HEADINGS))):
            total, tolerance = float(tasks[-1][place]), 6e-3 * len(tasks)
            assert sum(column(tasks[:-1], place)) == pytest.approx(total, abs=tolerance)
        assert float(tasks[-1][4]) == float(causes[-1][1])


def test_the_data_set_has_power_by_part_and_saving_by_cause(comparison, broken):
    data = result_dataset(comparison, mission_text="")
    base = float(data["physics_fuel"].sel(schedule="nominal"))
    for name, result in comparison.results.items():
        one = data.sel(schedule=name)
        assert float(one["saving"].sum()) == pytest.approx(base - float(one["physics_fuel"]), abs=1e-9)
        power = result.physics.shaft_power.total.mean(axis=1)
        np.testing.assert_allclose(one["physics_shaft_power"].sum("part"), power, rtol=1e-12)
    assert {"profile", "engine load"} <= set(data["cause"].values) and "tail rotor" in data["part"].values
    lost = replace(broken.results["trajectory"].physics, shaft_power=None)
    results = {**broken.results, "trajectory": replace(broken.results["trajectory"], physics=lost)}
    unknown = result_dataset(replace(broken, results=results), mission_text="")["saving"].isnull()
    assert unknown.any(["cause", "segment"]).values.tolist() == [name == "trajectory" for name in results]


def test_the_figure_shows_every_task_or_every_kind(comparison, monkeypatch):
    causes, tasks = saving_figure(comparison).axes
    assert [text.get_text() for text in causes.get_yticklabels()][-1] == "saved"
    ends = [bar.get_x() + bar.get_width() for bar in causes.patches]
    assert ends[-2] == pytest.approx(ends[-1])  # the last cause ends where the sum does
    names = [text.get_text() for text in tasks.get_yticklabels()]
    assert "hover at quay" in names and len(names) < MOST_TASKS
    monkeypatch.setattr("vrsopt.report.saving_plot.MOST_TASKS", 3)
    kinds = saving_figure(comparison).axes[1]
    assert "vertical climb" in [text.get_text() for text in kinds.get_yticklabels()]
    assert "by kind of task" in kinds.get_xlabel()


# -- how it was found, and checked -------------------------------------------------------------------------------------


def test_the_solver_is_told_with_its_effort_mesh_and_arcs(comparison):
    told = dict(solver_rows(comparison))
    assert told["iterations of IPOPT"] == "17 on 2 meshes, each from the solution before"
    assert told["error of its quadrature"].startswith("0.00 g of fuel, at most 0.003 g in an interval")
    assert "cruise to quay" in told["error of its quadrature"] and told["largest residual, scaled"] == "1.0e-09"
    assert told["intervals of the last mesh"] == "2, of 20.0 to 60 s"
    assert told["mission NOx, multiplier"] == "-0.25"
    assert [row[2:] for row in arc_rows(comparison)] == [
        ("idle at base", "nothing"),
        ("cruise to quay", "blade loading"),
    ]
    without = replace(only(comparison, "nominal"), trajectory=None)
    assert solver_rows(without) == [] and arc_rows(without) == []
    timed = replace(comparison, steps={"a": {"wall_s": 4.0, "cpu_s": 3.5}, "b": {"wall_s": 0.5, "cpu_s": 0.25}})
    assert step_rows(timed) == [("a", "4.0", "3.5"), ("b", "0.5", "0.2"), ("all", "4.5", "3.8")]
    assert step_rows(comparison) == []


def test_the_check_names_where_surrogate_and_physics_differ_most(comparison, broken):
    result = comparison.results["trajectory"]
    flight = result.flight
    worse = replace(flight, fuel_per_segment=flight.fuel_per_segment + np.eye(1, len(flight.fuel_per_segment), 2)[0])
    case = replace(comparison, results={**comparison.results, "trajectory": replace(result, flight=worse)})
    row = {row[0]: row for row in physics_rows(case)}["trajectory"]
    assert row[4].startswith("hover at base") and float(row[5]) == pytest.approx(1000.0, abs=5.0)
    assert float(row[3]) == pytest.approx(100 * (worse.fuel / result.physics.fuel - 1), abs=6e-4)
    lost = {row[0]: row for row in physics_rows(broken)}["trajectory"]
    assert lost[2:4] == ("-", "-")
    limits = {row[0]: row for row in usage_rows(comparison, "trajectory")}
    usage = 100 * np.nanmax(result.physics.usages[0])
    assert float(limits["blade loading"][2]) == pytest.approx(usage, abs=6e-3)


# -- from what ---------------------------------------------------------------------------------------------------------


def test_every_number_of_the_aircraft_is_told_with_its_source(comparison):
    aircraft = load_aircraft("bo105")
    found = {one.path: one for one in numbers(aircraft, aircraft.sources)}
    assert found["main_rotor", "radius"].cells == ("main rotor: radius", "4.91", "m", "", "PAD", "")
    assert not found["main_rotor", "radius"].unsure and found["transmission", "efficiency"].unsure
    assert found["main_rotor", "induced_power_factor"].unsure  # solved
    assert found["blade_loading_limit", "advance_ratio"].unsure  # assumed, without a range
    assert found["loading", "tanks", "main", "capacity"].cells[1] == "382"
    assert not any("variants" in path for path in found)
    engine = comparison.limits.engine
    assert {one.path for one in numbers(engine, engine.sources) if not one.unsure} >= {("design_point", "power")}
    text = page(comparison)
    for one in (*found.values(), *numbers(engine, engine.sources)):
        assert f"<td>{one.cells[0]}</td>" in text
    assert "BO 105 CB/CBS flight manual (Eurocopter)" in text


def test_settings_are_told_in_engineering_units(comparison):
    told = dict(setting_rows(comparison))
    assert told["have rotor speeds of"] == "75 to 115 % of 44.4 rad/s"
    assert told["change the rotor speed by"] == "at most 1 %/s" and "257 kW" in str(told["use at most"])
    settings = replace(comparison.settings, twist_rate=None, forbidden_bands=(ForbiddenBand(35.52, 39.96, 10.0),))
    told = dict(setting_rows(replace(comparison, settings=settings)))
    assert (
        told["change the twist by"] == "any rate"
        and told["not stay at rotor speeds of"] == "80 to 90 %, crossed in 10 s"
    )


def test_variants_have_their_own_anchors(with_variant):
    text = page(with_variant)
    assert 'id="results"' in text and 'id="twist_only"' in text and 'id="twist_only-results"' in text
    anchors = [part.partition('"')[0] for part in text.split('id="')[1:]]
    assert len(anchors) == len(set(anchors))
