"""Pictures and films of people."""
