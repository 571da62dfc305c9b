"""Whether lines that a function makes stand on a committed page, with the same numbers but for rounding."""

import re
from collections.abc import Iterable

NUMBER = re.compile(r"[+-]?\d+(?:\.\d+)?")
COUNT = re.compile(r"(?<![\d.+-])\d+(?![\d.]| (?:%|kW|K))")  # a whole number that is not rounded


def assert_on_page(lines: Iterable[str], page: str, last: float = 1.0) -> None:
    """Every line stands on ``page``, its words alike and its numbers at most ``last`` in the last digit off.

    Counts are alike, and the first cell of a row, which says what it is of.
    """
    written = page.split("\n")
    for line in "\n".join(lines).split("\n"):
        assert any(_alike(line, other, last) for other in written), f"not on the page: {line}"


def _alike(line: str, other: str, last: float) -> bool:
    if NUMBER.sub("#", line) != NUMBER.sub("#", other) or COUNT.findall(line) != COUNT.findall(other):
        return False
    if line.startswith("|") and line.split("|")[1] != other.split("|")[1]:
        return False
    pairs = zip(NUMBER.findall(line), NUMBER.findall(other), strict=True)
    return all(abs(float(a) - float(b)) <= 1.01 * last * 10.0 ** -len(a.partition(".")[2]) for a, b in pairs)
