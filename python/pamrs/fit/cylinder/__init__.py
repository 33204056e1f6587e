"""Friction of pneumatic cylinders over pressure, from strokes at constant pressure.

``record`` reads the recordings, ``friction`` finds the strokes and the breakaway in them and fits
the law, ``compare`` says what it depends on; ``report`` and ``figure`` show it.
"""
