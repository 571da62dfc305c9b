"""Fourier basis of a periodic motion on a uniform grid of azimuths."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Harmonics:
    """Series a_0 + sum_k a_k cos k psi + b_k sin k psi of ``highest`` harmonics, n_c = 1 + 2 highest coefficients.

    A row of coefficients (1, n_c) times ``values`` (n_c, N) is the motion at the azimuths, times ``rates`` its
    derivative by azimuth, times ``accelerations`` the second one; a row of values (1, N) times ``projection`` (N, n_c)
    gives the coefficients back (Galerkin).
    """

    highest: int
    count: int  # N, azimuths

    @property
    def size(self) -> int:
        """Number of coefficients n_c."""
        return 1 + 2 * self.highest

    @cached_property
    def azimuth(self) -> np.ndarray:
        """Azimuths (N,), rad, from psi = 0 aft, counter-clockwise."""
        return 2 * np.pi * np.arange(self.count) / self.count

    @cached_property
    def order(self) -> np.ndarray:
        """Harmonic of each coefficient (n_c,): 0, 1, 1, 2, 2, ..."""
        return np.concatenate([[0], np.repeat(np.arange(1, self.highest + 1), 2)])

    @cached_property
    def values(self) -> np.ndarray:
        """1, cos psi, sin psi, cos 2 psi, ... at the azimuths (n_c, N)."""
        waves = [np.ones(self.count)]
        for k in range(1, self.highest + 1):
            waves += [np.cos(k * self.azimuth), np.sin(k * self.azimuth)]
        return np.array(waves)

    @cached_property
    def rates(self) -> np.ndarray:
        """Derivatives of the basis by azimuth (n_c, N)."""
        waves = [np.zeros(self.count)]
        for k in range(1, self.highest + 1):
            waves += [-k * np.sin(k * self.azimuth), k * np.cos(k * self.azimuth)]
        return np.array(waves)

    @cached_property
    def accelerations(self) -> np.ndarray:
        """Second derivatives of the basis by azimuth (n_c, N)."""
        return np.asarray(-(self.order[:, None] ** 2) * self.values)

    @cached_property
    def projection(self) -> np.ndarray:
        """Pseudo-inverse of ``values`` (N, n_c)."""
        return np.linalg.pinv(self.values)
