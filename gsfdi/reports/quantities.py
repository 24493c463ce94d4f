"""What a published name means: ``motor_current_a`` is the motor current in amperes."""

SUFFIXES = {
    "nms2_rad2": "N m s²/rad²",
    "nms_rad": "N m s/rad",
    "nm_rad": "N m/rad",
    "ns2_m2": "N s²/m²",
    "ns_m": "N s/m",
    "n_m": "N/m",
    "kg_m2": "kg m²",
    "kg": "kg",
    "per_rad2": "1/rad²",
    "per_m2": "1/m²",
    "per_degc": "1/°C",
    "per_s": "1/s",
    "rad_s2": "rad/s²",
    "rad_s": "rad/s",
    "m_s2": "m/s²",
    "m_s": "m/s",
    "s_rad": "s/rad",
    "s_m": "s/m",
    "rad": "rad",
    "nm": "N m",
    "hz": "Hz",
    "a": "A",
    "c": "°C",
    "n": "N",
    "m": "m",
    "s": "s",
}
"""Unit that the end of a name stands for; longer ends first."""


def quantity(name: str) -> tuple[str, str]:
    """Split a published name into its words and its unit.

    Examples
    --------
    >>> quantity("drive_force_n"), quantity("half_width_rad"), quantity("ratio"), quantity("coefficient_ns_m")
    (('drive force', 'N'), ('half width', 'rad'), ('ratio', ''), ('coefficient', 'N s/m'))
    """
    for suffix, unit in SUFFIXES.items():
        if name.endswith("_" + suffix):
            return name.removesuffix("_" + suffix).replace("_", " "), unit
    return name.replace("_", " "), ""
