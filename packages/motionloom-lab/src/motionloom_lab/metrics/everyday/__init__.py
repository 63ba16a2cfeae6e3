"""What the everyday checks measure, by theme; their prompts and limits are in ``lab/suites/everyday_checks.toml``."""
