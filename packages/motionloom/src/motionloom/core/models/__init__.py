"""A weight file becomes a denoiser: priors, blocks for two people, predictors, adapters, and the networks in them."""
