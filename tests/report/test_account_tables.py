"""Energy of the rotor, what holds a schedule, and the advantage of the trajectory, in words."""

from dataclasses import replace

import numpy as np
import pytest

from vrsopt.report.account_tables import ACCOUNT_HEADINGS, account_rows, active_words, steps_line
from vrsopt.report.series import schedule_figure
from vrsopt.report.tables import footer, remarks, summary_text
from vrsopt.schedule.advantage import advantage
from vrsopt.schedule.bands import ForbiddenBand


def test_accounts_are_those_of_the_summary(comparison):
    schedules = comparison.summary()["schedules"]
    for row, figures in zip(account_rows(comparison), schedules.values(), strict=True):
        assert len(row) == len(ACCOUNT_HEADINGS)
        energy = figures["rotor_energy_kj"]
        expected = [energy[name] for name in ("charged", "credited", "jumped", "end_minus_start")]
        assert [float(text) for text in row[1:5]] == pytest.approx(expected, abs=0.051)
    assert schedules["pointwise"]["rotor_energy_kj"]["jumped"] < 0.0
    assert schedules["pointwise"]["rotor_energy_fuel_kg"] < 0.0  # borrowed: it ends with a slower rotor
    limited = schedules["trajectory"]["active_limits_percent"]
    assert limited["rotor speed rate"] > 1.0
    assert active_words(comparison, "trajectory").startswith("speed rate ")
    assert active_words(comparison, "nominal") == "nothing"


def with_fuel(comparison, *, surrogate: float, physics: float):
    """The comparison, had the trajectory burned these shares of the rate-limited schedule's fuel."""
    other, own = (comparison.results[name] for name in ("pointwise_rate_limited", "trajectory"))
    share = surrogate * other.flight.fuel / own.flight.fuel
    flight = replace(own.flight, fuel_per_segment=share * own.flight.fuel_per_segment)
    flown = replace(own.physics, fuel=physics * other.physics.fuel)
    return comparison.results | {"trajectory": replace(own, flight=flight, physics=flown)}


def test_a_small_advantage_is_not_claimed(comparison):
    small = advantage(with_fuel(comparison, surrogate=0.9999, physics=0.9999))
    assert small.surrogate == pytest.approx(0.01) and not small.established
    assert "advantage 0.010 % of the fuel (physics 0.010 %) is below the difference of surrogate and physics" in str(
        small
    )
    assert str(small).endswith("not established")
    large = advantage(with_fuel(comparison, surrogate=0.99, physics=0.9901))
    assert large.established and "above the errors of model and integration" in str(large)
    opposed = advantage(with_fuel(comparison, surrogate=0.995, physics=1.001))
    assert not opposed.established


def test_an_advantage_between_other_ends_is_not_claimed(comparison):
    results = with_fuel(comparison, surrogate=0.99, physics=0.9901)
    own = results["trajectory"]
    slower = own.schedule.rotor_speed.copy()
    slower[-1] *= 0.9
    ends = replace(own, schedule=replace(own.schedule, rotor_speed=slower))
    found = advantage(results | {"trajectory": ends})
    assert not found.established and str(found).endswith("end with another rotor speed or twist: not established")


def test_the_advantage_is_a_remark_and_in_the_summary(comparison):
    summary = comparison.summary()["advantage"]
    assert summary["words"] == str(advantage(comparison.results))
    assert f"T{summary['words'][1:]}." in remarks(comparison)
    lost = {name: one for name, one in comparison.results.items() if name != "trajectory"}
    assert advantage(lost) is None


def test_times_of_the_steps_are_told(comparison):
    assert steps_line(comparison) == ""
    timed = replace(comparison, steps={"pointwise search": {"wall_s": 2.04, "cpu_s": 1.96}})
    assert "Seconds on the clock (of the processor): pointwise search 2.0 (2.0)" in footer(timed)
    assert timed.summary()["steps"]["pointwise search"]["cpu_s"] == 1.96
    assert "Rotor energy and what is active" in summary_text(timed)


def test_forbidden_bands_are_hatched(comparison):
    bands = (ForbiddenBand(38.6, 42.2, 10.0),)
    banded = replace(comparison, settings=replace(comparison.settings, forbidden_bands=bands))
    panel = schedule_figure(banded).axes[3]
    hatched = [patch for patch in panel.patches if patch.get_hatch()]
    assert len(hatched) == 1
    low, high = hatched[0].get_y(), hatched[0].get_y() + hatched[0].get_height()
    assert np.allclose([low, high], [100 * 38.6 / 44.4, 100 * 42.2 / 44.4])
    assert "forbidden, crossing only" in [text.get_text() for text in panel.get_legend().get_texts()]
