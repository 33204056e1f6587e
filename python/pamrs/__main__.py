"""Run the command line as ``python -m pamrs``."""

import os
import sys


def main() -> int:
    """Run the command line, also while it is imported, which takes long enough to be interrupted.

    Returns
    -------
    int
        The exit code of :func:`pamrs.cli.main`.
    """
    try:
        from pamrs.cli import main as run

        return run()
    except KeyboardInterrupt:
        os.write(2, b"pamrs: interrupted\n")
        return 1


if __name__ == "__main__":
    sys.exit(main())
