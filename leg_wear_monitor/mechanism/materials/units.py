"""Units of the files of materials and drives, by what they measure, and their factors to SI.

Two traps are spelled out. A dimensionless K of Archard's law is worth nothing without the form of the law:
books write V = K F s / H and V = K F s / (3 H), so the unit names the form, and K / H or K / (3 H) is the
wear coefficient of this package. Makers give a wear rate in µm/km at a pressure, so the unit names 1 MPa.
"""

import attrs


@attrs.frozen
class Unit:
    """A unit of a file of a material or a drive.

    Attributes
    ----------
    dimension : str
        What it measures.
    factor : float
        SI value of one such unit; of a K, the factor before K / H.
    needs_hardness : bool
        Whether the number is a K, to be divided by a hardness.
    """

    dimension: str
    factor: float
    needs_hardness: bool = False


_MM3, _INCH, _POUND = 1.0e-9, 0.0254, 4.4482216152605  # m^3, m, N
_PSI = _POUND / _INCH**2
_FOOT_PER_MINUTE = 12.0 * _INCH / 60.0

UNITS = {
    "Pa": Unit("pressure", 1.0),
    "MPa": Unit("pressure", 1.0e6),
    "GPa": Unit("pressure", 1.0e9),
    "N/mm^2": Unit("pressure", 1.0e6),
    "psi": Unit("pressure", _PSI),
    "kgf/mm^2": Unit("pressure", 9.80665e6),
    "m/s": Unit("speed", 1.0),
    "ft/min": Unit("speed", _FOOT_PER_MINUTE),
    "Pa m/s": Unit("pressure times speed", 1.0),
    "MPa m/s": Unit("pressure times speed", 1.0e6),
    "N/mm^2 m/s": Unit("pressure times speed", 1.0e6),
    "psi ft/min": Unit("pressure times speed", _PSI * _FOOT_PER_MINUTE),
    "1/Pa": Unit("wear coefficient", 1.0),
    "mm^3/(N m)": Unit("wear coefficient", _MM3),
    "um/km at 1 MPa": Unit("wear coefficient", 1.0e-6 / 1.0e3 / 1.0e6),
    # volume over force, speed in ft/min and time in h: 60 ft of sliding for each ft/min and hour
    "in^3 min/(lbf ft h)": Unit("wear coefficient", _INCH**3 / (_POUND * 12.0 * _INCH * 60.0)),
    "K of V = K F s / H": Unit("wear coefficient", 1.0, needs_hardness=True),
    "K of V = K F s / (3 H)": Unit("wear coefficient", 1.0 / 3.0, needs_hardness=True),
    "degC": Unit("temperature", 1.0),
    "um": Unit("roughness", 1.0e-6),
    "ln": Unit("logarithmic standard deviation", 1.0),
    "1": Unit("number", 1.0),
    "s": Unit("time", 1.0),
    "ms": Unit("time", 1.0e-3),
    "Hz": Unit("frequency", 1.0),
    "N m": Unit("torque", 1.0),
    "N mm": Unit("torque", 1.0e-3),
    "N m s/rad": Unit("friction by speed", 1.0),
    "N m/rad": Unit("stiffness", 1.0),
    "N m/A": Unit("torque constant", 1.0),
}


def units_of(dimension: str) -> list[str]:
    """Names of the units that measure this."""
    return [name for name, unit in UNITS.items() if unit.dimension == dimension]
