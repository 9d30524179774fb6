"""Polarisation optics and its conventions, told once.

Stokes vectors
    ``(s0, s1, s2, s3)`` with s1 > 0 along the frame's x, s2 > 0 along +45° (from x toward y) and
    s3 > 0 right circular. The observer looks into the beam, back toward the source; the frame
    (x, y, z) is right-handed and z is the direction of propagation. Angles grow counter-clockwise
    as that observer sees them: right-handed about +z.

Retarders
    δ is the retardance and the axis given is the fast one.

Table frames
    L is the unit vector toward the light, V toward the camera. The incident beam travels along
    z = −L, the reflected one along z = +V, and both have x = norm(L × V), y = z × x. A facet whose
    normal is the half vector therefore appears un-rotated: its Mueller matrix is that of Fresnel's
    equations with x along s, perpendicular to the plane of incidence.

These are the conventions of Mitsuba 3 and of the published KAIST tables.
"""
