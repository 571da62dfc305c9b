"""The longest files first: with several workers none of them is left for the end."""

import pytest

LONGEST = ("test_readme", "test_notebooks", "test_rescue_mission", "test_compare", "test_shipped_data")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: item.path.stem not in LONGEST)
