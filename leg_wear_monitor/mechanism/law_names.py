"""Names of the contact laws: apart from the laws, so that reading a name does not wait for numba."""

NORMAL_LAWS = ("hertz", "hunt-crossley", "lankarani-nikravesh", "gonthier", "flores", "hu-guo", "winkler")
FRICTION_LAWS = ("ambrosio", "threlfall", "none")
