"""The mechanisms that decide pairs, by the names that ``docs/narrowphase.md`` explains."""

import enum

__all__ = ["Mechanism"]


class Mechanism(enum.IntEnum):
    """The algorithm that decided a distance. Kernels hand the numbers on, results the members."""

    OPEN = 0
    """Nothing proved it; ``gap`` says how far apart the bounds are."""
    CLOSED_FORM = 1
    """A formula for the two shapes."""
    SEPARATED = 2
    """One direction, along which they are further apart than was asked for."""
    GJK = 3
    """The bounds of GJK, which meet."""
    LIFTED = 4
    """A contact whose features the cores, moved apart, show: both bounds meet."""
    CRITICAL_DIRECTIONS = 5
    """All directions in which a depth can be least."""
    INNER_BALL = 6
    """A contact of least depth, proven by a ball within the Minkowski difference."""
    COVER = 7
    """A contact of least depth, proven by branch and bound over the directions."""
    REFINED = 8
    """The contact that GJK's last simplex shows, solved: both bounds meet."""
    EPA = 9
    """The bounds of the expanding polytope, which meet."""
    BASINS = 10
    """The expanding polytope, all of whose small faces lead to known minima."""
    ALL_FEATURES = 11
    """The best contact of all pairs of features from one direction."""
    NEAREST_PLACES = 12
    """As ALL_FEATURES, solved for the places on lines and rims."""
    BESIDE_AXIS = 13
    """As ALL_FEATURES, from a direction beside a rim's axis."""
    RESTARTS = 14
    """The best contact of all pairs of features from many directions."""
    TRIANGLES = 15
    """The nearest triangles of a mesh, or the rule for a mesh that is cut."""
