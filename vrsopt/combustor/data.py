"""The combustor as a network of stirred reactors: air splits, volumes, mixing; numbers from the engine's file."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from vrsopt.quantity import Record, Unit

Fraction = Annotated[float, Unit("-"), Field(ge=0, lt=1)]
Volume = Annotated[float, Unit("m3"), Field(gt=0, lt=1)]


class ReactorData(Record):
    """Zones of a combustor: primary (burns rich pockets and lean ones side by side), intermediate, dilution.

    Air fractions are of the air that enters the combustor; the rest of it enters the dilution zone. Unmixedness is the
    standard deviation of the fuel mass fraction over its mean, in what flows into the zone, of a normal distribution
    before that is cut off at ``mixture_cutoff`` of them (cut off at 1.5, 0.74 of it is left, at 2 0.88).
    ``recirculation``: part of what flows into the primary zone's reactors that is burnt gas of the zone's mean, which
    narrows the spread in the reactors by as much. ``methylene_fraction``: share of the fuel's carbon that passes
    through CH2 on its way to CO; prompt NO is proportional to it.
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
    methylene_fraction: Annotated[float, Unit("-"), Field(ge=0, le=0.5)]

    @model_validator(mode="after")
    def _leanest_pocket_has_fuel(self) -> ReactorData:
        for name in ("primary_unmixedness", "intermediate_unmixedness"):
            reach = getattr(self, name) * self.mixture_cutoff
            if reach >= 1.0:
                raise ValueError(f"{name}: times mixture_cutoff = {reach:.3g}: less than 1, a pocket can not lack fuel")
        return self

    @model_validator(mode="after")
    def _air_is_left(self) -> ReactorData:
        share = self.primary_air_fraction + self.intermediate_air_fraction
        if share >= 1.0:
            raise ValueError(f"intermediate_air_fraction: with primary_air_fraction {share:.3g}: less than 1")
        return self
