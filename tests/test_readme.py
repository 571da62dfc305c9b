"""The README's first example runs as it stands, and is short."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()


def first_example() -> str:
    found = re.search(r"```python\n(.*?)```", README, re.DOTALL)
    assert found
    return found.group(1)


def test_first_example_is_short():
    assert len(first_example().splitlines()) <= 25


@pytest.mark.slow
def test_first_example_runs():
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", first_example()], cwd=ROOT, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    saved = re.search(r"mission fuel (-\d+\.\d+) %, on the physics (-\d+\.\d+) %", done.stdout)
    assert saved, done.stdout
    assert float(saved[1]) == pytest.approx(float(saved[2]), abs=0.2)


def test_commands_for_a_fresh_machine_are_those_of_the_tests():
    assert 'pip install -e ".[test]" && pytest -n auto' in README
    assert "pip install -e . && vrsopt solve problems/sarm.toml --out results/sarm" in README
    run = (ROOT / ".ci" / "run").read_text()
    assert 'pip install --quiet -e ".[test]"' in run and "\npytest -n auto\n" in run


def test_files_the_readme_names_exist():
    for path in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (ROOT / path).is_file(), path
