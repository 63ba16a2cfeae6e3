"""Bodies in motion: inverse kinematics, feet that stay where they stand, and what a motion did, by physics."""
