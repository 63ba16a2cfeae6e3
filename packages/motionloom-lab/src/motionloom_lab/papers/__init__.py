"""Published methods, checkpoints and data sets, to measure against and to import."""
