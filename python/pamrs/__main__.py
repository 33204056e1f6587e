"""Run the command line as ``python -m pamrs``."""

import sys

from pamrs.cli import main

sys.exit(main())
