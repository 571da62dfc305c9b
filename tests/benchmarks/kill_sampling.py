"""Kill -9 at random moments of ``vrsopt sample``: is anything lost, and are the final rows those of a quiet run?

Samples the physics once without interruption and once killed again and again, the workers with it or only the process
that writes. Prints one JSON object: kills, and how many of them came while points were computed; rows that were on file
before a kill and not after it; whether the final rows, derivatives included, are identical to the last bit.

Run: python tests/benchmarks/kill_sampling.py [--samples 100] [--kills 20] [--workers 2] [--space level]
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import xarray as xr

from vrsopt.errors import InputError
from vrsopt.surrogate.database import Database, is_empty

Rows = dict[int, tuple[float, ...]]


def command(path: Path, arguments: argparse.Namespace) -> list[str]:
    words = ["sample", "--out", path, "--samples", arguments.samples, "--workers", arguments.workers]
    return [sys.executable, "-m", "vrsopt", *map(str, words), "--space", arguments.space, "--resume"]


def contents(path: Path) -> xr.Dataset:
    with Database.open(path) as database:
        return database.dataset().drop_vars("seconds")


def rows(path: Path, *, repair: bool = False) -> Rows:
    """Rows on file by point, with the time each took; none while a transaction is under way."""
    if not path.exists() or (repair and is_empty(path)):
        return {}
    try:
        with Database.open(path, write=repair) as database:
            table = database.rows()
    except InputError:
        if repair:
            raise
        return {}
    return dict(zip(table["point"], zip(table["mass"], table["seconds"], strict=True), strict=True))


def first_row(path: Path, arguments: argparse.Namespace) -> tuple[float, float]:
    """A quiet run: seconds to its first row, and to its end."""
    begin, first = time.monotonic(), 0.0
    process = subprocess.Popen(command(path, arguments), stdout=subprocess.DEVNULL)
    while process.poll() is None:
        if not first and rows(path):
            first = time.monotonic() - begin
        time.sleep(0.05)
    assert process.returncode == 0
    return first, time.monotonic() - begin


def kill_once(path: Path, arguments: argparse.Namespace, wait: float, group: bool) -> tuple[bool, Rows]:
    """Whether the run was still going when it was killed, and the rows that were on file just before."""
    process = subprocess.Popen(command(path, arguments), stdout=subprocess.DEVNULL, start_new_session=True)
    time.sleep(wait)
    before = rows(path)
    (os.killpg if group else os.kill)(process.pid, signal.SIGKILL)
    return process.wait() == -signal.SIGKILL, before


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=100)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--space", default="level")
    arguments = parser.parse_args()
    chance = random.Random(1)
    with tempfile.TemporaryDirectory() as folder:
        quiet, killed = Path(folder) / "quiet.db", Path(folder) / "killed.db"
        start, end = first_row(quiet, arguments)
        share = 1.6 * (end - start) / arguments.kills  # so that the last kill finds something left to do
        known: Rows = {}
        running, computing, lost = 0, 0, 0
        for number in range(arguments.kills):
            wait = chance.uniform(0.0, start) if number < 2 else start + chance.uniform(-0.3 * start, share)
            alive, before = kill_once(killed, arguments, wait, chance.random() < 0.5)
            after = rows(killed, repair=True)
            lost += sum(after.get(point) != row for point, row in (known | before).items())
            running, computing = running + alive, computing + (alive and after.keys() > known.keys())
            known = after
        left = len(known)
        subprocess.run(command(killed, arguments), check=True, stdout=subprocess.DEVNULL)
        final, reference = contents(killed), contents(quiet)
        figures = {
            "samples": arguments.samples,
            "rows": reference.sizes["point"],
            "kills": running,
            "kills_after_new_rows": computing,
            "rows_before_the_last_run": left,
            "rows_lost": lost,
            "identical": bool(final.identical(reference)),
            "quiet_run_s": round(end, 1),
        }
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
