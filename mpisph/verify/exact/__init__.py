"""Exact solutions, each a plain function with its source."""
