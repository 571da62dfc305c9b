"""Rotor: blade, section aerodynamics, inflow and periodic response."""
