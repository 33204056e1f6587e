"""The table of sixty logs and what each came out as: ``python -m tests.recordings``."""

import sys

from tests.recordings.sixty import main

sys.exit(main())
