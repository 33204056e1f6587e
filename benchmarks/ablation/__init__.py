"""What each part of the judgement brings: read cases of a trial with one part left out at a time.

Parts of prior and posterior are left out of what was weighed, which is kept of each case, without
new fits; parts of the search by diagnosing anew the cases in which a part found something.
What was kept and what went by such tables is in docs/decisions/0014.
"""
