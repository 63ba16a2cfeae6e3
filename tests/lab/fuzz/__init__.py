"""The fuzzer over what training and the laboratory read: `python -m tests.lab.fuzz` runs every reader there is."""
