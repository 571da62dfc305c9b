"""Tables of the pages that the studies write."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path


def table(header: Iterable[str], rows: Iterable[Iterable[object]]) -> Iterator[str]:
    """Lines of a Markdown table."""
    names = list(header)
    yield "| " + " | ".join(names) + " |"
    yield "|" + "---|" * len(names)
    for row in rows:
        yield "| " + " | ".join(str(cell) for cell in row) + " |"
    yield ""


def write_below(marker: str, page: Path, text: str, *, title: str) -> None:
    """Write ``marker`` and ``text`` below the words of ``page`` above the marker; one that is new gets a ``title``."""
    head = page.read_text(encoding="utf-8").partition(marker)[0] if page.exists() else f"# {title}\n\n"
    page.write_text(f"{head}{marker}\n{text}", encoding="utf-8")


@dataclass(frozen=True)
class Figure:
    """A number of the model and the range that its reference allows, in the unit and with the digits of ``form``."""

    quantity: str
    value: float
    low: float
    high: float
    form: str = "{:.3f}"
    source: str = ""
    stated: str = ""  # the reference as it is known, shown instead of the range

    @property
    def met(self) -> bool:
        return self.low <= self.value <= self.high

    def row(self) -> tuple[str, str, str, str]:
        """Quantity, model, reference, and whether the model meets it."""
        allowed = self.stated or f"{self.form.format(self.low)} to {self.form.format(self.high)}"
        reference = f"{allowed} ({self.source})" if self.source else allowed
        return self.quantity, self.form.format(self.value), reference, "yes" if self.met else "**no**"


def figures(found: Iterable[Figure]) -> Iterator[str]:
    """Lines of the table of figures."""
    yield from table(("quantity", "model", "reference", "met"), (figure.row() for figure in found))
