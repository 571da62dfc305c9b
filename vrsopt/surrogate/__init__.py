"""Surrogates: sampling of the physics, Kriging, validation and export to CasADi."""
