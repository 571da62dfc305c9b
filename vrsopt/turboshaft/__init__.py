"""Turboshaft: gas properties, component maps and the gas-path cycle."""
