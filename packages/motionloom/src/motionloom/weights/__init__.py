"""The weight files that ship, and their cards; `motionloom.core.models` reads them."""
