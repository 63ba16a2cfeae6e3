"""Not filled yet."""


def add(subparsers) -> None:
    """Register nothing."""
