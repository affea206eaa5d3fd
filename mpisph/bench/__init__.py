"""Measurements of speed, memory, traffic and start-up that anyone can repeat."""

PARTS = ("block", "impact", "late", "start-up")
"""What a bench may measure."""
