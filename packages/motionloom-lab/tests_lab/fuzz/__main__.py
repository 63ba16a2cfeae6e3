"""``python -m tests_lab.fuzz``: as ``python -m tests.fuzz``, with the readers of training and the laboratory too."""

import sys

from tests.fuzz.__main__ import main
from tests_lab.fuzz import readers

assert readers.OWN
sys.exit(main())
