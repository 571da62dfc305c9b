"""The kinds of HTML of a report: a long file shows its two ends."""

from vrsopt.report.markup import LONG, verbatim


def test_a_mission_file_is_shown_letter_by_letter_and_a_record_of_fixes_by_its_two_ends():
    mission = "\n".join(f"line {k} < {k + 1}" for k in range(LONG))
    assert verbatim(mission) == f"<pre>{mission.replace('<', '&lt;')}</pre>\n"
    record = "\n".join(f"fix {k}" for k in range(4000))
    shown = verbatim(record).splitlines()
    assert shown[0] == "<pre>fix 0" and shown[-1] == "fix 3999</pre>" and len(shown) < 40
    assert "3975 of 4000 lines" in verbatim(record)
