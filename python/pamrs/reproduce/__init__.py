"""The 2014 dissertation chapter by chapter: what it states beside what this package gives."""
