"""Names of the contact laws; a module of its own, so that checking a name does not import numba."""

NORMAL_LAWS = ("hertz", "hunt-crossley", "lankarani-nikravesh", "gonthier", "flores", "hu-guo", "winkler")
FRICTION_LAWS = ("ambrosio", "threlfall", "none")
