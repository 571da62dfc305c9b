"""Order of the files, and examples that are the same in every run."""

import pytest
from hypothesis import settings

LONGEST = ("test_readme", "test_notebooks", "test_rescue_mission", "test_compare", "test_shipped_data")

# Other examples than those of the last run are looked for on purpose: pytest --hypothesis-profile=default
settings.register_profile("reproducible", derandomize=True, database=None)
settings.load_profile("reproducible")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest files first: with several workers none of them is left for the end."""
    items.sort(key=lambda item: item.path.stem not in LONGEST)
