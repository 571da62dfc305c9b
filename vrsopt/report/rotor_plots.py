"""Figures of one operating point: what the blades feel, how they move, where the power goes and what margin is left."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vrsopt.report.style import BLUE, GREEN, NORMAL, ORANGE, SMALL, VERMILION, new_figure, tidy

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vrsopt.operating_point import OperatingPoint

# variable, title, colour map, symmetric about zero, contour range or None; where the section is slow a coefficient
# means little, the products with Mach number squared are loads
MAPS = (
    ("angle_of_attack_deg", "angle of attack, deg", "RdBu_r", (-15.0, 15.0)),
    ("mach", "Mach number", "viridis", None),
    ("cl_m2", r"$c_l M^2$", "RdBu_r", None),
    ("induced_velocity_m_s", "induced velocity, m/s", "RdBu_r", None),
)
LEVELS = 24


def point_figures(point: OperatingPoint) -> dict[str, Figure]:
    """The figures of a trimmed point by the name of their file."""
    from vrsopt.rotor_fields import rotor_map

    fields = rotor_map(point)
    return {
        "rotor_maps": rotor_maps_figure(fields),
        "blade_motion": blade_motion_figure(fields),
        "powers_and_margins": powers_and_margins_figure(point),
    }


def rotor_maps_figure(fields: xr.Dataset) -> Figure:
    """Polar maps of the disc seen from above: flight is upwards, the blade advances on the right."""
    from matplotlib.ticker import MaxNLocator

    figure = new_figure(9.0, 7.6)
    axes = figure.subplots(2, 2, subplot_kw={"projection": "polar"})
    for ax, (name, words, colours, bounds) in zip(axes.ravel(), MAPS, strict=True):
        ax.set_theta_zero_location("S")
        values = fields[name]
        low, high = bounds or (float(values.min()), float(values.max()))
        if colours.startswith("RdBu"):  # white is zero
            high = max(abs(low), abs(high))
            low = -high
        levels = MaxNLocator(LEVELS).tick_values(low, high)
        angle, radius = np.meshgrid(np.radians(fields["azimuth"]), fields["radius"])
        drawn = ax.contourf(angle, radius, values, levels=levels, cmap=colours, extend="both" if bounds else "neither")
        ax.set_title(words, fontsize=NORMAL)
        ax.set_ylim(0.0, 1.0)
        ax.set_xticks(np.radians([0, 90, 180, 270]), ["0°", "90°\nadvancing", "180°", "270°\nretreating"])
        ax.set_yticks([0.5, 1.0], ["", ""])
        ax.tick_params(labelsize=SMALL)
        ax.grid(color="#00000030", linewidth=0.6)
        figure.colorbar(drawn, ax=ax, shrink=0.7, pad=0.14, ticks=levels[::4]).ax.tick_params(labelsize=SMALL)
    return figure


def blade_motion_figure(fields: xr.Dataset) -> Figure:
    """Deflection of the outermost station and the load along the blade, against azimuth."""
    figure = new_figure(8.0, 7.0)
    axes = figure.subplots(4, 1, sharex=True)
    tip, azimuth = fields.isel(radius=-1), fields["azimuth"]
    rows = (("flap_m", "flap, m", BLUE), ("lag_m", "lag, m", ORANGE), ("torsion_deg", "elastic twist, deg", GREEN))
    for ax, (name, words, colour) in zip(axes, rows, strict=False):
        ax.plot(azimuth, tip[name], color=colour)
        ax.set_ylabel(words, fontsize=NORMAL)
        tidy(ax)
    load = fields["lift_n_m"].interp(radius=[0.5, 0.75, 0.9])
    for radius, colour in zip(load["radius"], (BLUE, GREEN, VERMILION), strict=True):
        axes[3].plot(azimuth, load.sel(radius=radius), color=colour, label=f"{float(radius):.2f} R")
    axes[3].set_ylabel("lift, N/m", fontsize=NORMAL)
    axes[3].legend(fontsize=SMALL, ncols=3, frameon=False)
    axes[3].set(xlim=(0, 360), xticks=range(0, 361, 45))
    axes[3].set_xlabel("azimuth, deg (0 aft, 90 advancing)", fontsize=NORMAL)
    axes[0].set_title("blade tip, and load along the blade", fontsize=NORMAL)
    tidy(axes[3])
    return figure


def powers_and_margins_figure(point: OperatingPoint) -> Figure:
    """Where the power of the rotors goes, and how much of each limit is used."""
    figure = new_figure(8.0, 4.6)
    upper, lower = figure.subplots(2, 1)
    powers = {name: 1e-3 * value for name, value in point.powers.items()}
    _bars(upper, powers, dict.fromkeys(powers, BLUE), "{:.0f}")
    upper.set_xlabel("power, kW", fontsize=NORMAL)
    used = {name: 100.0 * usage for name, usage in point.usages.items()}
    colours = {name: VERMILION if value > 100.0 else GREEN for name, value in used.items()}
    _bars(lower, used, colours, "{:.0f} %")
    lower.axvline(100.0, color="black", linewidth=1.0)
    lower.set_xlabel("used of the limit, %", fontsize=NORMAL)
    return figure


def _bars(axes: Axes, values: dict[str, float], colours: dict[str, str], form: str) -> None:
    names = list(values)
    bars: Any = axes.barh(names, list(values.values()), color=[colours[name] for name in names])
    axes.bar_label(bars, [form.format(value) for value in values.values()], fontsize=SMALL, padding=3)
    axes.invert_yaxis()
    axes.margins(x=0.12)
    tidy(axes)
