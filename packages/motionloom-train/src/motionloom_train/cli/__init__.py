"""Commands that `motionloom` shows where this package is installed."""
