"""Everyday prompts with physical checks, by theme; `CHECKS` of the ``sets`` module holds them all."""
