"""Pages and pictures of the catalogue of effects: ``python -m fingerprints docs/effects``
(``make effects``).
"""
