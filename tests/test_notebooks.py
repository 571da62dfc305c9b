"""Every notebook runs from its first cell to its last; the first one in tests/schedule/test_rescue_mission.py."""

import warnings

import pytest

from tests.shown_code import FIRST_NOTEBOOK, NOTEBOOKS


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # of the machinery that runs notebooks, not of ours: cells raise their own
@pytest.mark.parametrize("path", [path for path in NOTEBOOKS if path != FIRST_NOTEBOOK], ids=lambda path: path.stem)
def test_notebook_runs(path):
    import nbformat
    from nbclient import NotebookClient

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        notebook = nbformat.read(path, as_version=4)
        client = NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(path.parent)}})
        client.execute()
    assert all(cell.cell_type != "code" or cell.execution_count for cell in notebook.cells)


def test_notebooks_are_committed_without_output():
    import nbformat

    assert FIRST_NOTEBOOK in NOTEBOOKS
    for path in NOTEBOOKS:
        notebook = nbformat.read(path, as_version=4)
        assert all(not cell.get("outputs") for cell in notebook.cells), path.name
