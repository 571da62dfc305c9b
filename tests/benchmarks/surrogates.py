"""How long surrogates take, as one JSON object:

    python tests/benchmarks/surrogates.py [fit] [libraries] [export] [sampling] [--points 400]

``fit``: Kriging of the shipped design's fuel flow, 1500 points in five variables, CPU time [s] with its leave-one-out.
``libraries``: 500 of those points, with the same correlation, against scikit-learn and SMT (``pip install smt``; left
out where it is not installed), tested on the other 1000; four minutes. ``export``: a sweep of value, gradient and
Hessian over the nodes of a path by CasADi. ``sampling``: the same ``--points`` flyable points of the space of seven
variables, with derivatives, by one and by two workers (1500 take some fifteen minutes); for a quiet machine. One BLAS
thread. Nothing here gates a test.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Matern, WhiteKernel
from sklearn.linear_model import LinearRegression
from sklearn.preprocessing import PolynomialFeatures
from threadpoolctl import threadpool_limits

from vrsopt.surrogate.database import Database
from vrsopt.surrogate.export import to_casadi
from vrsopt.surrogate.kriging import Kriging
from vrsopt.surrogate.space import LEVEL
from vrsopt.surrogate.validation import accuracy

CORRELATIONS = ("exponential", "matern52", "squared_exponential")
SMT_NAMES = dict(zip(CORRELATIONS, ("abs_exp", "matern52", "squar_exp"), strict=True))
SMALL = 500  # points of the comparison with the libraries
STARTS = (10, 2)  # of SMT: its default, and as many as ours, of which both may end in a poor optimum
NODES = (200, 400)
SWEEPS = 20
FREE = ("mass", "rotor_speed", "twist")
SEED = 7

ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}

Figures = dict[str, Any]


def cpu(action: Callable[[], Any]) -> tuple[Any, float]:
    """Result and CPU time [s]."""
    begin = time.process_time()
    result = action()
    return result, time.process_time() - begin


@contextmanager
def shipped(name: str) -> Iterator[Database]:
    """A design of experiments of the package."""
    with resources.as_file(resources.files("vrsopt") / "data" / name) as file, Database.open(file) as database:
        yield database


def fuel_flow() -> tuple[np.ndarray, np.ndarray]:
    """Inputs (1500, 5) and fuel flow (1500,) of the shipped design's flyable points."""
    with shipped("design.db") as database:
        inputs, outputs = database.arrays()
        return inputs, outputs[:, database.meta.outputs.index("fuel_flow")]


def kriging(correlation: str) -> Kriging:
    return Kriging(correlation, names=LEVEL.names, lower=LEVEL.lower, upper=LEVEL.upper)


def fit() -> Figures:
    """CPU time [s] of fit and leave-one-out with every correlation, and the errors of the latter [%]."""
    inputs, fuel = fuel_flow()
    found: Figures = {"fit_points": len(fuel)}
    for correlation in CORRELATIONS:
        model, fitting = cpu(lambda c=correlation: kriging(c).fit(inputs, fuel))
        left, leaving = cpu(model.leave_one_out)
        figures = accuracy(*left)
        found |= {
            f"{correlation}_fit_s": fitting,
            f"{correlation}_leave_one_out_s": leaving,
            f"{correlation}_pearson_percent": figures.pearson_percent,
            f"{correlation}_mean_abs_error_percent": figures.mean_abs_error_percent,
            f"{correlation}_rms_error_percent": figures.rms_error_percent,
        }
    return found


def libraries() -> Figures:
    """CPU time of fits [s], its ratio to ours, and error at the points left [%], at equal correlation and trend.

    scikit-learn has no trend: a quadratic one is fitted and taken off first. Its Matern correlations are radial, ours
    and SMT's products over the inputs; its squared exponential is both.
    """
    inputs, fuel = fuel_flow()
    order = np.random.default_rng(SEED).permutation(len(fuel))
    few, others = order[:SMALL], order[SMALL:]
    scaled = (inputs - np.array(LEVEL.lower)) / (np.array(LEVEL.upper) - np.array(LEVEL.lower))
    found: Figures = {"libraries_points": SMALL, "libraries_test_points": len(others)}

    def record(name: str, seconds: float, predicted: np.ndarray) -> None:
        found[f"{name}_s"] = seconds
        found[f"{name}_mean_abs_error_percent"] = accuracy(fuel[others], predicted).mean_abs_error_percent

    for correlation in CORRELATIONS:
        model, own = cpu(lambda c=correlation: kriging(c).fit(inputs[few], fuel[few]))
        record(f"{correlation}_ours", own, model.predict(inputs[others]))
        predict, seconds = cpu(lambda c=correlation: regressor(c, scaled[few], fuel[few]))
        record(f"{correlation}_scikit_learn", seconds, predict(scaled[others]))
        found[f"{correlation}_scikit_learn_over_ours"] = seconds / own
        for starts in STARTS:
            fitted, seconds = cpu(lambda c=correlation, n=starts: smt(c, scaled[few], fuel[few], n))
            if fitted is None:
                found["smt"] = "not installed: pip install smt"
                break
            name = f"{correlation}_smt_{starts}_starts"
            record(name, seconds, fitted.predict_values(scaled[others])[:, 0])
            found[f"{name}_over_ours"] = seconds / own
    return found


def regressor(correlation: str, scaled: np.ndarray, output: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """scikit-learn's Gaussian process about a quadratic trend; its prediction."""
    length = np.full(scaled.shape[1], 0.5)
    kernels = {"exponential": Matern(length, nu=0.5), "matern52": Matern(length, nu=2.5)}
    kernel = ConstantKernel(10.0, (1e-3, 1e6)) * kernels.get(correlation, RBF(length, (1e-2, 1e2)))
    trend = PolynomialFeatures(2)
    line = LinearRegression().fit(trend.fit_transform(scaled), output)
    rest = output - line.predict(trend.transform(scaled))
    process = GaussianProcessRegressor(kernel + WhiteKernel(1e-5, (1e-12, 1e-1)), normalize_y=True, random_state=SEED)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        process.fit(scaled, rest)
    return lambda points: line.predict(trend.transform(points)) + process.predict(points)


def smt(correlation: str, scaled: np.ndarray, output: np.ndarray, starts: int) -> Any:
    """SMT's Kriging with a quadratic trend, fitted; None where SMT is not installed."""
    try:
        from smt.surrogate_models import KRG
    except ImportError:
        return None
    model = KRG(corr=SMT_NAMES[correlation], poly="quadratic", n_start=starts, print_global=False, seed=SEED)
    model.set_training_values(scaled, output)
    model.train()
    return model


def export() -> Figures:
    """CPU time to build [s] and per sweep [ms] of value, gradient and Hessian, and the error of the polynomials [%]."""
    inputs, fuel = fuel_flow()
    model = kriging("squared_exponential").fit(inputs, fuel)
    found: Figures = {}
    for count in NODES:
        along = np.linspace(0.0, 1.0, count)
        fixed = {"altitude": 1500.0 * along * (1.0 - along), "speed": 20.0 + 30.0 * along}
        for method in ("callback", "chebyshev"):
            name = f"{method}_{count}_nodes"
            exported, building = cpu(lambda m=method, f=fixed: to_casadi(model, method=m, fixed=f, free=FREE))
            sweep, deriving = cpu(lambda e=exported, n=count: second_order(e.function, n))
            found[f"{name}_build_s"] = building + deriving
            times = [cpu(lambda at=path, go=sweep: go(at))[1] for path in paths(count)]
            found[f"{name}_sweep_ms"] = 1e3 * statistics.median(times)
            if method == "chebyshev":
                found[f"{name}_error_percent"] = 100.0 * exported.error
    return found


def paths(count: int) -> list[np.ndarray]:
    """Values of the free variables (3, count), different in every sweep: nothing is found in a cache."""
    rng = np.random.default_rng(SEED)
    columns = [LEVEL.names.index(name) for name in FREE]
    middle = 0.5 * (np.array(LEVEL.lower) + np.array(LEVEL.upper))[columns, None]
    return [middle * rng.uniform(0.95, 1.05, (len(FREE), count)) for _ in range(SWEEPS)]


def second_order(function: Any, count: int) -> Callable[[np.ndarray], Any]:
    """What a solver asks for at one iterate: the values (1, count), and gradient and Hessian of a weighted sum."""
    x, weights = ca.MX.sym("x", len(FREE), count), ca.MX.sym("weights", 1, count)
    values = function(x)
    hessian, gradient = ca.hessian(ca.dot(weights, values), ca.vec(x))
    whole = ca.Function("sweep", [x, weights], [values, gradient, hessian])
    ones = np.ones((1, count))
    return lambda path: whole(path, ones)


def sampling(points: int) -> Figures:
    """Wall times [s] of the same points by one and by two workers, from the command line, and CPU time per point [s].

    The efficiency of two workers is half the ratio of the wall times. Every process begins by building the model's
    functions, which weighs the less the more points there are. Beside it the CPU time behind the shipped design.
    """
    with shipped("flight_design.db") as database:
        seconds = database.dataset()["seconds"].values
    found: Figures = {"shipped_points": len(seconds), "shipped_cpu_s_per_point": float(np.nanmean(seconds))}
    found["sampling_flyable_points"] = points
    for workers in (1, 2):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "design.db"
            begin = time.perf_counter()
            command = [sys.executable, "-m", "vrsopt", "sample", "--space", "flight", "--seed", str(SEED)]
            command += ["--samples", str(points), "--workers", str(workers), "--out", str(path)]
            subprocess.run(command, check=True, capture_output=True, env=os.environ | ONE_THREAD)
            wall = time.perf_counter() - begin
            with Database.open(path) as database:
                seconds = database.dataset()["seconds"].values
        found |= {
            f"sampling_{workers}_wall_s": wall,
            f"sampling_{workers}_points": len(seconds),
            f"sampling_{workers}_cpu_s_per_point": float(np.nanmean(seconds)),
            f"sampling_{workers}_cpu_s_per_point_median": float(np.nanmedian(seconds)),
        }
    found["sampling_efficiency"] = found["sampling_1_wall_s"] / (2.0 * found["sampling_2_wall_s"])
    return found


def main() -> None:
    parts: dict[str, Callable[[], Figures]] = {"fit": fit, "libraries": libraries, "export": export}
    parser = argparse.ArgumentParser(description="Times of the surrogates.")
    parser.add_argument("parts", nargs="*", choices=[*parts, "sampling"], default=[])
    parser.add_argument("--points", type=int, default=400, help="flyable points of the sampling")
    options = parser.parse_args()
    parts["sampling"] = lambda: sampling(options.points)
    figures: Figures = {}
    with threadpool_limits(limits=1):
        for part in options.parts or parts:
            figures |= parts[part]()
    rounded = {name: value if isinstance(value, str) else float(np.round(value, 6)) for name, value in figures.items()}
    print(json.dumps(rounded, indent=2))


if __name__ == "__main__":
    main()
