"""The trial's second plan: strata of strength, number, form, model error, wrong parameters, rigs
and recordings, each scored on its own.

:mod:`.design` draws what a case is, :mod:`.cases` makes it, :mod:`.marks` scores it and
:mod:`.tables` lays the scores beside the targets.
"""
