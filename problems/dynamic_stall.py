"""Dynamic stall of NACA 0012 against oscillating-aerofoil tests: eleven frames, one set of constants, no tuning.

    python problems/dynamic_stall.py dynstall.npz

Measured by McAlister, Pucci, McCroskey and Carr (NASA TM 84245, 1982). The file holds for each frame Mach number, mean
angle, amplitude [deg] and reduced frequency in ``f<frame>_meta_M_a0_a1_k``, phase [deg] and coefficient in
``f<frame>_time_exp_cl`` and ``f<frame>_clt_exp``, and angle of attack [deg] and coefficient in
``f<frame>_alpha_exp_cl`` and ``f<frame>_cl_exp``; likewise cd and cm. Prints the table of errors and writes
figures/dynamic_stall.png. Mean angle, amplitude, Mach number and frequency are all that changes from frame to frame:
section and time constants are those of vrsopt/data/naca_0012.toml.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

from vrsopt.report.plots import png
from vrsopt.report.style import BLUE, NORMAL, SMALL, VERMILION, new_figure, tidy
from vrsopt.rotor.airfoil import load_section
from vrsopt.rotor.oscillating_section import SectionLoop, harmonic_pitch, section_loop

# The target, then light and deep stall, slow and fast, shifted mean angles and a lower Mach number.
FRAMES = (9302, 7110, 7113, 9221, 9222, 9223, 9307, 10105, 10303, 9217, 9203)
QUANTITIES = ("cl", "cd", "cm")
WORDS = ("lift", "drag", "moment")
BLOCKS = 2
FIGURE = Path(__file__).parent / "figures" / "dynamic_stall.png"


def loop(frame: str, data: Any) -> SectionLoop:
    mach, mean, amplitude, frequency = data[f"{frame}_meta_M_a0_a1_k"]
    pitch = harmonic_pitch(np.radians(mean), np.radians(amplitude))
    return section_loop(load_section("naca_0012"), pitch, mach=float(mach), reduced_frequency=float(frequency))


def values(computed: SectionLoop) -> dict[str, np.ndarray]:
    return {"cl": computed.c_l, "cd": computed.c_d, "cm": computed.c_m}


def errors(frame: str, data: Any) -> dict[str, float]:
    """Extremes computed and measured, and the rms difference over the period."""
    computed = values(loop(frame, data))
    phase = np.arange(len(computed["cl"])) * 360 / len(computed["cl"])
    row = {
        "cl_max": float(computed["cl"].max()),
        "cl_max_test": float(data[f"{frame}_cl_exp"].max()),
        "cm_min": float(computed["cm"].min()),
        "cm_min_test": float(data[f"{frame}_cm_exp"].min()),
    }
    for quantity in QUANTITIES:
        measured = data[f"{frame}_{quantity}t_exp"]
        here = np.interp(data[f"{frame}_time_exp_{quantity}"] % 360, phase, computed[quantity], period=360)
        row[f"rms_{quantity}"] = float(np.sqrt(np.mean((here - measured) ** 2)))
    return row


def table(rows: dict[str, dict[str, float]], data: Any) -> str:
    lines = [
        "frame   Mach  mean  ampl.    k    cl max  test   diff.   cm min   test   diff.  rms cl  rms cd  rms cm",
    ]
    for frame, e in rows.items():
        mach, mean, amplitude, k = data[f"{frame}_meta_M_a0_a1_k"]
        lines.append(
            f"{frame[1:]:>5}  {mach:5.3f} {mean:5.1f} {amplitude:5.1f}  {k:5.3f}"
            f"   {e['cl_max']:5.3f} {e['cl_max_test']:6.3f} {e['cl_max'] - e['cl_max_test']:+6.3f}"
            f"   {e['cm_min']:6.3f} {e['cm_min_test']:6.3f}  {e['cm_min'] - e['cm_min_test']:+6.3f}"
            f"   {e['rms_cl']:5.3f}   {e['rms_cd']:5.3f}   {e['rms_cm']:5.3f}"
        )
    means = {key: np.mean([abs(e[key]) for e in rows.values()]) for key in ("rms_cl", "rms_cd", "rms_cm")}
    lift = np.mean([abs(e["cl_max"] - e["cl_max_test"]) for e in rows.values()])
    moment = np.mean([abs(e["cm_min"] - e["cm_min_test"]) for e in rows.values()])
    lines.append(
        f" mean{lift:45.3f}{moment:24.3f}   {means['rms_cl']:5.3f}   {means['rms_cd']:5.3f}   {means['rms_cm']:5.3f}"
    )
    return "\n".join(lines)


def draw(data: Any, path: Path) -> None:
    """Three rows, lift, drag and moment, twice: the frames in two blocks, so that they can be read on a page."""
    figure = new_figure(11.5, 11.5)
    across = -(-len(FRAMES) // BLOCKS)
    axes = figure.subplots(BLOCKS * len(QUANTITIES), across)
    columns = np.concatenate(np.split(axes, BLOCKS), axis=1).T
    for row, words in enumerate(WORDS):
        for other in columns[1 : len(FRAMES)]:
            other[row].sharey(columns[0, row])
        for block in range(BLOCKS):
            columns[block * across, row].set_ylabel(f"{words} coefficient", fontsize=NORMAL)
    for column in columns[len(FRAMES) :]:
        for axis in column:
            axis.axis("off")
    for column, number in zip(columns, FRAMES, strict=False):
        frame = f"f{number}"
        computed = loop(frame, data)
        closed = np.append(np.arange(len(computed.pitch)), 0)
        mach, _, _, k = data[f"{frame}_meta_M_a0_a1_k"]
        column[0].set_title(f"frame {number}\nM = {mach:.2f}, k = {k:.3f}", fontsize=SMALL)
        for axis, quantity in zip(column, QUANTITIES, strict=True):
            measured = data[f"{frame}_alpha_exp_{quantity}"], data[f"{frame}_{quantity}_exp"]
            axis.plot(*measured, ".", color=VERMILION, markersize=3, label="test")
            axis.plot(np.degrees(computed.pitch)[closed], values(computed)[quantity][closed], color=BLUE, label="model")
            tidy(axis)
        column[2].set_xlabel("angle of attack, deg", fontsize=SMALL)
    figure.legend(*columns[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=2, fontsize=NORMAL)
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(png(figure))


def main(path: Path) -> None:
    with np.load(path) as data:
        print(table({f"f{number}": errors(f"f{number}", data) for number in FRAMES}, data))
        draw(data, FIGURE)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    main(Path(sys.argv[1]))
