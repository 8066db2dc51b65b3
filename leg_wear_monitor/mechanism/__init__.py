"""The mechanism: its description, its arrays, its ideal motion; names of the contact laws.

The modules imported here import neither numpy nor numba.
"""

NORMAL_LAWS = ("hertz", "hunt-crossley", "lankarani-nikravesh", "gonthier", "flores", "hu-guo", "winkler")
FRICTION_LAWS = ("ambrosio", "threlfall", "none")
