"""The README's first example is short, its commands and files are there; test_rescue_mission.py runs the example."""

import re

from tests.shown_code import ROOT, first_example

README = (ROOT / "README.md").read_text()


def test_first_example_is_short():
    assert len(first_example().splitlines()) <= 25


def test_commands_for_a_fresh_machine_are_those_of_the_tests():
    assert 'pip install -e ".[test]" && pytest -n auto' in README
    assert "pip install -e . && vrsopt solve problems/sarm.toml --out results/sarm" in README
    run = (ROOT / ".ci" / "run").read_text()
    assert 'pip install --quiet -e ".[test]"' in run and "\npytest -n auto\n" in run


def test_files_the_readme_names_exist():
    for path in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (ROOT / path).is_file(), path
