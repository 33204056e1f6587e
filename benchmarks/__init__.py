"""Speed of the package beside its reference, in one run on one machine."""
