"""What other methods make of the same trial: refitting alone, SINDy on the residual, a Gaussian
process of the discrepancy.

All start from the diagnosis' own refitted baseline and cut chain, learn on the recordings to fit,
and are judged on the held-out ones by the diagnosis' own measure, the gap closed. None of them
names anything: what they give is a better prediction, or a sparse equation in measured signals, but
no component. So their share of right names is 0 by construction.
"""
