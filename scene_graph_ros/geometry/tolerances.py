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

MIN_MESH_SIZE = 1e-30
"""Metres. A mesh or hull whose largest extent is smaller is refused, but for a single point: the
squares of its volumes would be below the smallest of all numbers."""

MIN_SCALE = 1e-8
"""Smallest accepted magnitude of a mesh's scale factor, per axis (dimensionless)."""

OSCULATION = 4.0 * EPSILON
"""Relative to the pair's size: a penetration shallower than this counts as touching."""

HULL_FLATNESS = (1e-12, 1e-11, 1e-10, 1e-9)
"""Relative to the extent of a point set: a set thinner than the first is treated as flat (or as a
segment, or a point); rounding of coordinates makes coplanar points about 1e-15 thick. The others
are tried in turn for needles in which qhull, whose own limit is about 1e-14 in volume, finds no
solid; the hull's vertices stay points of the set."""

HULL_COPLANARITY = 1e-13
"""Relative to the extent of a hull: triangles this close to a plane become one face, so that the
support of a merged face is off by less than a tenth of the promised 1e-12."""

CELL_MARGIN = 1e-12
"""Relative to the largest coordinate of a hull: a vertex is left out of a cell of directions only
where another lies further along all of them by more, so that rounding can't choose it."""

FLAT_SIMPLEX = 64.0 * EPSILON
"""Relative to the product of its edges: a simplex with less area or volume counts as flat, since
rounding of its corners alone can give it that much."""

GJK_ROUNDING = 4.0
"""In units of EPSILON times the pair's largest coordinate: the rounding of one support point of
the Minkowski difference. A distance or a gap below it can't be told from zero."""

ROTATION_ROUNDING = 8.0 * EPSILON
"""Largest entry of ``R.T @ R - I`` at which a rotation counts as orthonormal to rounding and is
taken over bit for bit: three products and two sums of numbers up to 1."""

ZERO_DIRECTION = 1e-10
"""Smallest accepted length of a vector that is to give a direction (its own unit)."""

COINCIDENCE = 16.0 * EPSILON
"""Relative to a shape's size: lengths that differ by less count as equal, and the stated rule for
ties decides. A point that was moved through two poses is off by about this much."""

UNDERFLOW = 1e-150
"""Relative to a shape's size: a coordinate below it is taken as zero, as its square would be."""

WITNESS_SPLIT = 1e-9
"""Relative to a mesh's size: two equally near points further apart than this are two answers, and
the nearest point is not unique; closer ones are one point seen from two triangles."""

PARALLEL_LINES = 64.0 * EPSILON
"""Sine of an angle: lines closer to parallel than this have a common normal that is rounding, if
they are as long as they are far from the origin; shorter ones in proportion."""

POLISH_RESIDUAL = 32.0
"""In units of EPSILON times the pair's largest coordinate: what may be left of a - b = phi n at a
contact that counts as exact; two rotations and two support points round that much."""

DEGENERATE_TRIANGLE = 1e-14
"""Twice a triangle's area relative to the square of its longest side, below which it has none:
the directions of its sides, known to about 1e-16, then give no normal."""

TIE = 64.0
"""In units of EPSILON times the pair's largest coordinate: depths this close count as equal."""

FLAT_MINIMUM = 1e-10
"""Relative to the pair's size: a depth whose second derivative over the normal is smaller than
this has no single best direction (for example across a cylinder's axis)."""

SAME_DIRECTION = 1.0 - 1e-10
"""Cosine: unit vectors with a larger dot product (within 1.4e-5 rad) are one direction."""

NEIGHBORHOOD = 1.0 - 5e-9
"""Cosine: within this of the direction of the least depth (1e-4 rad), equal depths are the same
one, and bounds of the depth on a curved body may stay a little below it."""

BOX_ROUNDING = 8.0 * EPSILON
"""Relative to the coordinates that enter: bounding boxes are grown by this, so that rounding
never loses a pair. Five products and sums are rounded by half an EPSILON each."""

PARALLEL = 64.0 * EPSILON
"""Sine of an angle: directions this close count as parallel, and features as flat on each other.
Products of a few rotations are off by about this much; it moves a witness by 1.4e-14 L."""

CONVEX_VOLUME = 1e-12
"""Relative to the hull's volume: a closed mesh that encloses as much as its hull is convex. A dent
that is missed moves the surface by less than the promised accuracy, unless it is a pinhole."""

NEAR_CONTACT = 1e-6
"""Relative to the pair's size: closer than this, GJK's direction v / |v| loses the digits that EPA
and the polish keep; and shares of a depth are not taken of less than this."""

INNER_BALL_SPARE = 1e-6
"""Relative to the pair's size: by how much inner balls must be larger than a depth for it to be
the least one and the only one. Rounding takes 1e-15; this leaves others deeper by far."""

CONTACT_MISFIT = 1e-11
"""Relative to the pair's size: how far a witness may be from the support point along the normal
where what is known of the curvature there is used. It may cost the square of this over
INNER_BALL_SPARE, which is rounding."""

POINTS_BESIDE = 1e-3
"""Weight of a length that nearest points are beside each other, against one by which a direction
fails to separate the boxes. It breaks ties: less than a size over any likely distance."""

KINK = 1e-9
"""Relative to a shape's size, and in radians: a witness this near the border of its face or edge,
or a normal this near the border of its cone, is at a kink, where nothing is differentiable. It is
a thousand times the error of either."""

SINGULAR_CONTACT = 1e-9
"""Smallest singular value, of a matrix with unit columns, at which the witnesses of a pair count
as fixed by their optimality: below it their derivatives keep less than half of all digits."""

CONTACT_TIE = 64.0 * EPSILON
"""Relative to the coordinates of a pair of bodies: a corner this close to a plane lies in it, so
that elements flat on each other are told from elements that cut each other. Two poses and a plane
through three corners round about this much."""

CONTACT_RESOLUTION = 1e-12
"""Relative to the coordinates of a pair of bodies: a face of a contact surface that is narrower,
or a side that is shorter, is dropped. What is lost is as small beside what is kept."""

PLACED_RESOLUTION = 16.0 * EPSILON
"""Relative to the distance from the world's origin: the same for what world coordinates, rounded
to half an EPSILON each, can tell apart."""

EQUAL_FIELDS = 1e-10
"""Relative to the pressure gradients' lengths: fields whose difference is shorter are equal, and
their surface of equal pressure has no direction (identical bodies on top of each other)."""

PRESSURE_DIRECTION = -0.3826834323650898
"""Cosine (of 112.5 degrees): a face counts where each compliant side's pressure gradient is within
this angle of the way into that side. Up to a right angle the pressure grows into the body; a
coarse mesh's gradients turn by up to tens of degrees from one element to the next, and a sharp
limit would tear holes. Faces on a body's far side, seen through it, are nearer to 180 degrees."""

FLAT_TETRAHEDRON = 1e-9
"""Six times a deformed tetrahedron's volume, with its sign, relative to the product of the three
edges at its first corner: up to this it counts as flat or turned inside out and has no part in
contact. Barycentric coordinates in what is left keep half of all digits."""

MEDIAL_AXIS = 1e-7
"""Relative to a shape's size: a medial axis shorter than this along some direction counts as a
point there. Its tetrahedra would be that thin, and the field that they would give exactly is then
off by as much."""

DEEPEST_POINT = 1e-3
"""Relative: the centre found for the largest ball inside a hull is at most this much less deep
than the deepest. It lies in the middle of all that are as deep; its own depth is exact."""

MARGIN_DEFECT = 1e-3
"""Relative: by how much the layer around a mesh may be thinner than its margin at a vertex."""
