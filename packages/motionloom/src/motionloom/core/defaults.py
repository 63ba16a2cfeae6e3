"""How motions are sampled unless somebody says otherwise, and the bounds of it (docs/decisions/0008)."""

STEPS, SOLVER, SPACING, GUIDANCE = 24, "ddpm", "early", 2.5
LARGEST_SEED = 2**62
"""Seeds are below it."""
LARGEST_GUIDANCE = 100
