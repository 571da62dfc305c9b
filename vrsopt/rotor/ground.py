"""Ground effect on the main rotor, by the method of images of Cheeseman and Bennett.

I. C. Cheeseman, W. E. Bennett, "The effect of the ground on a helicopter rotor in forward flight", ARC R&M 3021 (1955):
at constant power the thrust near the ground is 1 / (1 - x) of that far from it, x = (R / 4 z)^2 / (1 + (V / v_i)^2), z
the height of the rotor above the ground and v_i its induced velocity. Its momentum form: at constant induced power
T v the induced velocity falls to (1 - x) of its value, while the thrust it belongs to has grown by 1 / (1 - x). A rotor
of that greater thrust would have the velocity (1 - x)^(-1/2) far from the ground (v ~ sqrt(T) in hover), so at equal
thrust the ground multiplies it by (1 - x)^(3/2). In forward flight, where v ~ T, the same factor is kept: x is small.
"""

from __future__ import annotations

from typing import Any

LARGEST_PROXIMITY = 2.0  # R / z: the image is a source, too coarse for a rotor closer than half a radius


def ground_factor(proximity: Any, advance_ratio: Any, mean_induced: Any) -> Any:
    """Induced velocity at the blades over that of the same thrust far from the ground, 1 for ``proximity`` 0.

    proximity: rotor radius over the height of the hub above the ground, 0 to ``LARGEST_PROXIMITY``; at 4 the formula
    ends. advance_ratio, mean_induced: in-plane airspeed and induced velocity far from the ground over the tip speed.
    """
    induced = mean_induced**2 + 1e-10
    x = (proximity / 4) ** 2 * induced / (induced + advance_ratio**2)
    return (1 - x) ** 1.5
