"""The combustor as a network of stirred reactors: air splits, volumes, mixing; numbers from the engine's file."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from vrsopt.quantity import Record, Unit

Fraction = Annotated[float, Unit("-"), Field(ge=0, lt=1)]
Volume = Annotated[float, Unit("m3"), Field(gt=0, lt=1)]


class ReactorData(Record):
    """Zones of a combustor: primary (burns rich pockets and lean ones side by side), intermediate, dilution.

    Air fractions are of the air that enters the combustor; the rest of it enters the dilution zone. Unmixedness is the
    standard deviation of the fuel mass fraction over its mean, cut off at ``mixture_cutoff`` standard deviations.
    ``recirculation``: part of what flows into the primary zone's reactors that is burnt gas of the zone.
    """

    primary_air_fraction: Annotated[float, Unit("-"), Field(gt=0, lt=1)]
    intermediate_air_fraction: Fraction
    primary_volume: Volume
    intermediate_volume: Volume
    dilution_volume: Volume
    primary_unmixedness: Fraction
    intermediate_unmixedness: Fraction
    mixture_cutoff: Annotated[float, Unit("-"), Field(gt=0, le=3)]
    recirculation: Fraction
