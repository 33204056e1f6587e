"""Independent plant, concealed cases and scoring for the blinded trial.

Nothing here imports the package under test.
"""

from .concealed import make_case

__all__ = ["make_case"]
