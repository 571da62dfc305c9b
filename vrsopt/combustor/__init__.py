"""Combustor: chemistry, stirred reactors, and the network of them that gives NOx and CO."""
