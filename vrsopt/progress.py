"""What a long computation is doing and since when, on standard error while it lasts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def telling(what: str, *, wanted: bool) -> Iterator[Callable[[str], None]]:
    """Show ``what`` is done and the time it has taken, if ``wanted``; the line goes when the context ends.

    Gives a function that takes the name of the step that begins, to be shown behind ``what``.
    """
    if not wanted:
        yield lambda step: None
        return
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        row = bar.add_task(what, total=None)
        yield lambda step: bar.update(row, description=f"{what}: {step}")
