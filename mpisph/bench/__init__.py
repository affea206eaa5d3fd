"""Measurements of speed, memory, traffic and start-up that anyone can repeat."""
