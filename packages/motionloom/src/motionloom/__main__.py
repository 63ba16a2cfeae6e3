"""`python -m motionloom`."""

import sys

from motionloom.cli import main

if __name__ == "__main__":
    sys.exit(main())
