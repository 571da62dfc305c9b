"""The one rule for numbers in JSON, which knows no infinity and no nan."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


def json_value(content: Any) -> Any:
    """``content`` with None (null) for every float that is not finite, in mappings, lists and tuples at any depth."""
    if isinstance(content, Mapping):
        return {name: json_value(value) for name, value in content.items()}
    if isinstance(content, list | tuple):
        return [json_value(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content
