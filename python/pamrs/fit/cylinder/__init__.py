"""Friction of pneumatic cylinders over pressure, from strokes at constant pressure.

``record`` reads the recordings, ``strokes`` finds the strokes and the breakaway in them, ``friction`` fits the law, ``compare`` says
what it depends on; ``report`` and ``figure`` show it.
"""
