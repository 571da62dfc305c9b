"""Solvers behind every residual system: IPOPT and damped Newton, with one vocabulary of statuses."""
