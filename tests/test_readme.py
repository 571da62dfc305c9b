"""The README's first example is short, its commands and files are there, its figures are those of the pages;
test_rescue_mission.py runs the example."""

import re
import shlex

import pytest

from tests.shown_code import ROOT, first_example

README = (ROOT / "README.md").read_text(encoding="utf-8")
PROBLEMS = ROOT / "problems"
PAGES = [ROOT / "README.md", *sorted(PROBLEMS.glob("*.md"))]
LINK = re.compile(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)")
SCRIPT = re.compile(r"`(?:python )?((?:problems|tests)/[\w/.]+\.(?:py|json|toml))")


def validation_rows(page: str) -> list[str]:
    """Rows of the table of validation figures, which has a command in its last column."""
    return re.findall(r"^\| .* \| `python (?:problems|tests)/[\w/]+\.py(?: [\w.]+)*` \|$", page, re.MULTILINE)


def test_first_example_is_short():
    assert len(first_example().splitlines()) <= 25


def test_commands_for_a_fresh_machine_are_those_of_the_tests():
    assert 'pip install -e ".[test]" && pytest -n auto' in README
    assert "pip install -e . && vrsopt solve problems/sarm.toml --out results/sarm" in README
    run = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert 'pip install --quiet -e ".[test]"' in run and "\npytest -n auto\n" in run


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_what_a_page_links_and_runs_is_there(path):
    text = path.read_text(encoding="utf-8")
    for link in LINK.findall(text):
        assert (path.parent / link).exists(), link
    for script in SCRIPT.findall(text):
        assert (ROOT / script).is_file(), script


def test_validation_figures_are_those_of_the_validation_page():
    """The page's first table is written by problems/validation.py; the README shows it row by row."""
    page = (PROBLEMS / "validation.md").read_text(encoding="utf-8")
    written = [row.replace("](problems/", "](") for row in validation_rows(README)]
    assert len(written) >= 10
    assert written == validation_rows(page)


def study_rows() -> list[list[str]]:
    """Cells of the table of all other studies."""
    index = (PROBLEMS / "README.md").read_text(encoding="utf-8")
    lines = index[index.index("## All other studies") :].split("\n")
    rows = [line for line in lines if re.match(r"\| `[a-z_]+\.py", line)]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]


def test_index_of_studies():
    """Every script has its row, every row its scripts, page, figures and time."""
    rows, named = study_rows(), set()
    for script, _, _, figures, time in rows:
        named |= set(re.findall(r"`([\w]+\.py)`", script))
        for pattern in re.findall(r"`(figures/[^`]+|[\w*{},]+\.png)`", figures):
            name = pattern.removeprefix("figures/")
            options = re.search(r"\{([^}]*)\}", name)
            for option in options.group(1).split(",") if options else [""]:
                wanted = re.sub(r"\{[^}]*\}", option, name)
                assert list((PROBLEMS / "figures").glob(wanted)), wanted
        assert re.fullmatch(r"-|[\d.]+ (s|min)( CPU|, two cores)?", time), (script, time)
    assert all((PROBLEMS / script).is_file() for script in named)
    runnable = {
        path.name for path in PROBLEMS.glob("*.py") if '__name__ == "__main__"' in path.read_text(encoding="utf-8")
    }
    assert runnable == named


def test_commands_of_the_readme_parse():
    """Indented commands of this package name commands and options that it has."""
    from typer.main import get_command

    from vrsopt.cli import app

    known = get_command(app).commands
    for line in re.findall(r"^    (vrsopt .+)$", README, re.MULTILINE):
        for command in line.split(" && "):
            words = shlex.split(command)
            assert words[1] in known, command
            options = {option for one in known[words[1]].params for option in (*one.opts, *one.secondary_opts)}
            assert {word for word in words[2:] if word.startswith("--")} <= options, command
