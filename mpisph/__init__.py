"""Axisymmetric smoothed-particle hydrodynamics for hypervelocity impact."""

__version__ = "0.1.0"
