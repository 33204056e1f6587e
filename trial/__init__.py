"""Independent plant, concealed cases and scoring for the blinded trial.

Nothing here imports the package under test. The public entry points are :func:`make_case` and
:func:`score`.
"""

from .concealed import make_case
from .score import score

__all__ = ["make_case", "score"]
