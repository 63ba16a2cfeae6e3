"""Networks small enough for tests: graphs out of a file, weights from a generator of random numbers."""
