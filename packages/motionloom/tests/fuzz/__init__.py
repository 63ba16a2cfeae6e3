"""Mutated files for every reader: a value or one sentence, within five seconds and a gigabyte.

``python -m tests.fuzz --seconds 3600`` (or ``make fuzz SECONDS=3600``) tries as many as fit; a short run is part of the
tests. `readers` lists who reads what, `mutations` how files are damaged, `machine` runs and watches.
"""
