"""The fuzzer over what training and the laboratory read: `python -m tests_lab.fuzz` runs every reader there is."""
