"""Every tolerance of the geometry core, with its unit and its reason."""

import math
import sys

EPSILON = sys.float_info.epsilon
"""Distance from 1.0 to the next double (dimensionless)."""

INFINITY = math.inf

ROTATION_DEFECT = 1e-6
"""Largest accepted entry of ``R.T @ R - I``; a pose this close is re-orthonormalized, one further
off is refused. Quaternions that went through float32 messages are good to about 1e-7."""

QUATERNION_NORM_DEFECT = 1e-3
"""Largest accepted ``abs(norm - 1)`` of a quaternion in a message, before normalization."""

MAX_COORDINATE = 1e12
"""Metres. Largest accepted coordinate of a pose; its square and cube stay finite by far."""

MIN_SHAPE_SIZE = 1e-9
"""Metres. Smallest accepted size parameter of a shape."""

MAX_SHAPE_SIZE = 1e9
"""Metres. Largest accepted size parameter of a shape."""

MIN_SCALE = 1e-8
"""Smallest accepted magnitude of a mesh's scale factor, per axis (dimensionless)."""

OSCULATION = 4.0 * EPSILON
"""Relative to the pair's size: a penetration shallower than this counts as touching."""
