"""Measurements of speed, memory, traffic and start-up that anyone can repeat."""

SCENES = ("block", "impact", "late", "small")
"""What is stepped."""

PARTS = (*SCENES, "start-up")
"""What a bench may measure."""

SMALL_NPR = 11
"""Particles along the radius of the sphere of the small scene: some thousand in all."""
