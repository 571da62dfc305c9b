"""All or the named parts of the study, then the page from all that are there.

    python -m problems.study [missions space left_out maps turbine climb bars schedules benefit]

From the root of the repository. Results go to problems/study/results, figures to problems/figures/study_*.png, the page
to problems/study/study.html.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from rich.console import Console
from rich.progress import track

from .finding import RESULTS, save
from .page import page

PARTS = ("missions", "space", "left_out", "maps", "turbine", "climb", "bars", "schedules", "benefit")
PAGE = Path(__file__).with_name("study.html")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the parts, write the page."""
    names = list(sys.argv[1:] if arguments is None else arguments) or list(PARTS)
    unknown = [name for name in names if name not in PARTS]
    if unknown:
        print(f"error: {', '.join(unknown)}: one of {', '.join(PARTS)}", file=sys.stderr)
        raise SystemExit(2)
    console = Console(stderr=True)
    for name in track(names, description="study", console=console):
        console.print(name)
        save(name, import_module(f".{name}", __package__).run())
    files = {name: RESULTS / f"{name}.json" for name in PARTS}
    kept = {name: json.loads(file.read_text(encoding="utf-8")) for name, file in files.items() if file.is_file()}
    PAGE.write_text(page(kept), encoding="utf-8")
    console.print(f"{len(kept)} of {len(PARTS)} parts on {PAGE.name}")


if __name__ == "__main__":
    main()
