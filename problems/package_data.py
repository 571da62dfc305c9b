"""Regenerate the shipped designs of experiments and surrogates.

Samples both spaces with derivatives (1500 flyable points each, seed 1), fits every output and puts the four files into
the package once all of them are complete. A run that was interrupted is continued by the same command; the numbers do
not depend on it, nor on the number of workers. It takes some twenty minutes on two cores.

Run: python problems/package_data.py [--work build/package_data] [--workers 2]
"""

from __future__ import annotations

import argparse
import os
import shutil
from pathlib import Path

import vrsopt
from vrsopt.surrogate.design import sample

SAMPLES, SEED = 1500, 1
FILES = {"level": ("design.db", "surrogate.nc"), "flight": ("flight_design.db", "flight_surrogate.nc")}
PACKAGE_DATA = Path(vrsopt.__file__).parent / "data"


def build(work: Path, workers: int, *, samples: int = SAMPLES) -> list[Path]:
    """Sample and fit both spaces in the folder ``work``; the four files."""
    work.mkdir(parents=True, exist_ok=True)
    for space, (design, _) in FILES.items():
        print(sample(work / design, space=space, samples=samples, seed=SEED, workers=workers, resume=True))
    for design, surrogate in FILES.values():
        print(vrsopt.fit(work / design, work / surrogate, workers=workers))
    return [work / name for pair in FILES.values() for name in pair]


def install(files: list[Path], target: Path) -> None:
    """Copy ``files`` into the folder ``target``, each replaced at once."""
    for file in files:
        copy = target / f"{file.name}.new"
        shutil.copyfile(file, copy)
        os.replace(copy, target / file.name)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path, default=Path("build/package_data"))
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    files = build(arguments.work, arguments.workers)
    install(files, PACKAGE_DATA)
    total = sum((PACKAGE_DATA / file.name).stat().st_size for file in files)
    print(f"{PACKAGE_DATA}: {total / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
