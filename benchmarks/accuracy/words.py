"""The text of docs/accuracy.md between its tables."""

__all__ = [
    "INTRODUCTION",
    "METHOD",
    "ONE_BY_ONE",
    "SCENE_DISTANCE",
    "SCENE_PENETRATION",
    "SUMMARY",
    "WITH_FCL",
]

SCENE_PENETRATION = "scene: penetration"
SCENE_DISTANCE = "scene: distance up to 0.1 m"

ONE_BY_ONE = "exact, one by one"
WITH_FCL = 'engine="fcl"'

INTRODUCTION = """\
# How exact the answers are, and what a digit costs

![Error against time of a query, for every pair, tier and peer](accuracy.png)

Queries about pairs of shapes are answered at one of three tiers of accuracy. `exact` is the
default: its answers are true to rounding, so no tolerance downstream has to allow for them. What
has a closed form or is soon proven to rounding, as nearly all pairs of primitives and of hulls of
up to 32 vertices, every tier answers exactly, for stopping earlier would save nothing: a scene of
such shapes takes the same time at any tier. `quick` and `standard` stop earlier where iterations
are left, which saves up to a third of the time of cylinders and ellipsoids against larger hulls.
Choose `quick` where nearly all that is asked about are such pairs and a thousandth of a shape's
size does not matter; `standard` stays below a micrometre.

```python
scene_graph = SceneGraph(accuracy="standard")  # the model's tier; "exact" if nothing is said
query.compute_point_pair_penetration(accuracy="quick")  # one query's
table = query.compute_signed_distance_pairwise_closest_points(0.1, certificate=True)
table.gap  # metres: what each answer proves of its own error
```

The node's parameter is `accuracy`; its diagnostics name the tier and what it costs per update.

- A tier promises that a distance or depth is off by no more than a part of the size of the pair's
  larger shape (its bounding box' longest side). Tests hold it to that, for every pair.
- Which pairs penetrate does not depend on the tier. Points are measured exactly at every tier.
- `p_WCa - p_WCb = distance * nhat_BA_W` holds to rounding at every tier. The direction of the
  normal is good to about the square root of what is promised of the distance.
- `certificate=True` adds the column `gap`, from the answer itself and the shapes' support
  functions alone, whatever found it. Apart, the distance is off by no more than that. Overlapping,
  moving by the depth along the normal makes the shapes touch to within it; that no other way out
  is shorter is what the tests are for.
- `engine="fcl"` asks FCL (python-fcl) instead, behind the same API, as MoveIt does: `fcl.collide`
  for penetration, `fcl.distance` for distances. It serves to compare with what its users know, to
  tell whether a difference comes from the geometry or from the engine. FCL promises no bound, has
  no tolerance to choose in Python, no distance of half spaces or points, and no depth of meshes
  that are measured by their triangles; such queries are refused with the reason. Depths of curved
  shapes 2 cm deep are off by millimetres, and normals by tens of degrees.

## Which tier?
"""

SUMMARY = """\
*Promised* and *worst error seen* are of distances and depths of all 35 pairs of shapes, as below.
*One pair* is the median over the pairs at 2 mm, when asked about hundreds at once. The *scenes*
hold 1000 mixed shapes (5 % of the volume filled); every pose is new before every query, and
setting the poses counts.

## At a glance

The worst error in m over all 35 pairs (two half spaces have no distance), with the number of pairs
that an engine refuses or has no finite answer for in brackets; and the median over the pairs of
the time of a query, 2 mm apart.
"""

METHOD = """\
## Method

- **Made by `make accuracy`**, which installs the peers (`make peers`), measures for some minutes
  and writes this page, [`accuracy.csv`](accuracy.csv) and the plots. `python -m
  benchmarks.accuracy --help` tells the options.
- **Known answers by construction.** Two convex bodies get supporting planes at a random point of a
  random feature each (face, edge, vertex, side, rim, smooth surface), the planes are laid on each
  other, the bodies turned about the common normal and slid along it. Apart, the gap is the
  distance. Overlapping, it is the depth, if no other direction offers a shorter way out; that is
  searched for, and such configurations are thrown away. The search decides which configurations
  count, never what their answer is. See `benchmarks/accuracy/constructions.py`.
- **Sizes** are 14 to 22 cm, poses are generic, features and both orders of the shapes take turns,
  every third pair has parallel or crossed edges and axes. {count} configurations for each pair and
  distance, seed {seed}; those of 2 mm are what other engines' tables are about.
- **A mesh** stands for its convex hull, as it does between shapes by default. It has a pit, so
  that its triangles differ from its hull. Points are measured against its triangles.
- **What is stated of the tiers** is a power of ten, 4 to 40 times the worst error seen, for other
  processors round in other ways; 1e-14 m is rounding of the coordinates that go in, up to 5 m.
  `test/numerics/test_precision_table.py` holds the table to it in both directions: a larger error
  fails, and so does one a hundred times smaller, for then the table is out of date. Of the peers
  the measured error is shown.
- **Searched for what no construction thinks of.** `test/numerics/search.py` makes pairs of any two
  of the eight shapes, random or nasty - nearly aligned, concentric, just touching, a millionth as
  large, a thousand kilometres away - and asks each pair as it is, with A and B exchanged, and with
  B moved by a nanometre. Faults are an exception, nan, a normal that is no unit vector, witnesses
  off their surfaces, a normal that does not separate by the distance, another direction that
  separates more, an answer that depends on the order, and a change larger than the motion; all by
  more than 1e-9 of the size. A mesh measured by its triangles need not be separated by any one
  direction as a whole: of it, the triangles that the witness is on have to be behind the
  normal's plane; where it overlaps, the rule of [meshes.md](meshes.md) decides, and the normal,
  the convex body's side of it and that no direction separates more are judged. The first searches
  of 333 334 pairs (1 000 002 queries) found up to eight faults each, all of which are mended;
  seeds 7, 50, 51 and 52, asked after that, had none, nor had seed 72, asked when the depths of
  round bodies had come to be proven by covering all directions; nor have 33 334 pairs of seed 81
  and 100 000 of seed 82, asked of the present kernels. With `--meshes` it looks among
  meshes measured by their triangles only, most of them next to contact with their features, on
  their hulls and off them: of 40 000 pairs (120 000 queries) each, seeds 12, 13, 14, 40, 50, 52
  and 54 had no fault, and 51 and 53 one each, mended since; 53 and 55, asked after that, have
  none, nor have 6667 of seed 62, asked of the present kernels. So of 360 000 such pairs about two
  can still be expected to have a fault nobody knows.
  The 129 pairs in which searches found a fault are kept in `test/support/hard_corpus` and asked
  by every test run, and none is open.
- **Engines.** Called from Python, on one thread. The tiers: one call for a scene of many such
  pairs, candidates included, divided by their number. `exact, one by one`, Drake, Coal, FCL and
  MuJoCo: one call for each pair, poses given before. Penetrations of Drake and MuJoCo come from
  one call for the scene, which is what they offer. Tolerances are each library's defaults but
  where the name says otherwise; Drake and FCL have none to set from Python. MuJoCo keeps the
  vertices of meshes in single precision.
- **Times** are the fastest of five rounds, in microseconds for one query; they depend on the
  machine, so compare them only within the table.
- `refused`: the engine raises, or has no such query. `no answer`: it returns NaN, infinity or a
  sentinel. An overlap that an engine doesn't see counts with its full depth.

![Error against time of a query, 2 mm deep](accuracy_deep.png)
"""
