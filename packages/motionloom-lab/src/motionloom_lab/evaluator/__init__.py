"""Networks that judge motion against words: our own, its training, and which one a report uses."""
