"""Figures of a study: lines, maps, shots, convergence."""
