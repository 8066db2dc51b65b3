"""The page of the how-to guides for each fault code, so that a message leads to what to do."""

FOLDER = "docs/howto/verdict"
START = "index"

CODES_OF_GUIDES = {
    START: ("NONE", "ALARM"),
    "joint_at_limit": ("CLEARANCE", "CLEARANCE_SEEN", "CLEARANCE_BELIEVED", "PART_REPLACED"),
    "clearance_changed": (
        "CLEARANCE_CHANGED",
        "CLEARANCE_CORRECTED",
        "CLEARANCE_DEPARTURE",
        "DIAGNOSIS",
    ),
    "torque_sensor": (
        "TORQUE_SIGN",
        "TORQUE_SCALE",
        "TORQUE_TIMING",
        "TORQUE_BIAS",
        "TORQUE_DRIFT",
        "TORQUE_LAG",
    ),
    "torque_mismatch": ("TORQUE_MISMATCH", "MECHANISM_CHANGED", "TORQUE_MASS"),
    "load_and_friction": ("TORQUE_LOAD", "FRICTION_CHANGED"),
    "foot_load": (
        "FOOT_LOAD_EXCHANGED",
        "FOOT_LOAD_MISSING",
        "FOOT_LOAD_SCALE",
        "FOOT_LOAD_SIGN",
        "FOOT_LOAD_STUCK",
        "FOOT_LOAD_ZERO",
        "INPUT_GAPS_FOOT_LOAD",
        "INPUT_RATE_FOOT_LOAD",
    ),
    "force_growth_life": ("IMPACT_FORCE", "GROWTH", "REMAINING_LIFE", "MATERIAL_LIMIT"),
    "input": (
        "BAD_INPUT",
        "INPUT_GAPS",
        "INPUT_RATE_CRANK",
        "INPUT_RATE_TORQUE",
        "INPUT_SAMPLES",
        "INPUT_SILENCE",
        "INPUT_SOURCES",
        "INPUT_TORQUE",
        "NO_GAIT_CYCLE",
        "TOPICS",
    ),
    "gait": ("CADENCE", "CRANK_ZERO", "NOT_FOLLOWED", "NOT_THIS_LEG"),
    "not_observed": ("ENCODER", "ENCODERS", "NOT_OBSERVED", "NO_DRIVE_TORQUE", "TORQUE_NOT_COMPARED"),
    "node": (
        "ALREADY_COUNTED",
        "CLOCK_MISSING",
        "CLOCK_SET_BACK",
        "CLOCK_STOPPED",
        "LEDGER_INTERRUPTED",
        "LEDGER_NOT_WRITTEN",
        "RECORDING_STOPPED",
        "SAMPLES_DROPPED",
        "SAMPLES_NOT_PUBLISHED",
        "STAMPS_AHEAD",
    ),
}
"""Codes without their joints, by the name of the page; a test compares them with the codes that there are."""

_PAGES = {code: page for page, codes in CODES_OF_GUIDES.items() for code in codes}


def guide_of(code: str) -> str:
    """Path of a code's page below the share directory; the overview for an unknown code.

    Parameters
    ----------
    code : str
        Without joints: ``CLEARANCE_SEEN``, not ``CLEARANCE_SEEN_G``.
    """
    return f"{FOLDER}/{_PAGES.get(code, START)}.md"
