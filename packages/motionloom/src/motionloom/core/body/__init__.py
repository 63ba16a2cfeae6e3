"""From sampled joint places to a body: rotations of constant bones, and feet that stay where they stand."""
