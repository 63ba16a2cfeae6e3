"""Training: networks as PyTorch modules, data sets, recipes, and graphs for the runtime."""
