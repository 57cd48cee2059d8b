"""The text of docs/accuracy.md between its tables."""

__all__ = [
    "EACH_PAIR",
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
default: its answers are true to rounding, so no tolerance downstream has to allow for them.

Most pairs cost the same at any tier. Those with a closed form are exact anyway; so are nearly all
pairs of primitives and of hulls of up to 32 vertices, whose first answer is proven to rounding.
`quick` and `standard` stop iterations earlier, which saves up to a third of the time of cylinders
and ellipsoids against larger hulls. Choose `quick` where a scene is full of such pairs and a
thousandth of a shape's size does not matter; `standard` stays below a micrometre.

```python
from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.scene_files import load_scene

scene_graph = SceneGraph(accuracy="standard")  # the model's tier; "exact" if nothing is said
loaded = load_scene("config/scenes/panda_cell.yaml").apply(scene_graph)
context = scene_graph.create_default_context()
loaded.set_initial_poses(context)
query = scene_graph.query_object(context)
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
- `certificate=True` adds the column `gap`. It follows from the answer and the shapes' support
  functions alone, whatever found the answer. Apart, the distance is off by no more than `gap`.
  Overlapping, moving by the depth along the normal makes the shapes touch to within `gap`; it does
  not say that no other way out is shorter.
- `engine="fcl"` asks FCL (python-fcl) behind the same API: `fcl.collide` for penetration,
  `fcl.distance` for distances, as MoveIt does. It tells whether a difference comes from the
  geometry or from the engine. FCL promises no bound and has no tolerance to choose in Python. It
  has no distance of half spaces or points, and no depth of meshes that are measured by their
  triangles; such queries are refused with the reason. Its depths of curved shapes 2 cm deep are
  off by millimetres, and its normals by tens of degrees.

## Which tier?
"""

SUMMARY = """\
*Promised* and *worst error seen* are of distances and depths of all 35 pairs of shapes, as below.
*One pair* is the median over the pairs 2 mm apart, asked about hundreds at once. The *scenes* hold
1000 mixed shapes (5 % of the volume filled); every pose is new before every query, and setting the
poses counts.

## At a glance

The worst error in m over all 35 pairs (two half spaces have no distance). In brackets: the number
of pairs that an engine refuses or has no finite answer for. The time of a query is the median over
the pairs, 2 mm apart.
"""

EACH_PAIR = """\
## Each pair

![Worst errors of each pair and engine, as colours](accuracy_map.png)

[`accuracy.csv`](accuracy.csv) has all figures: for each query, pair, distance and engine the worst
and the median error, what is stated of our tiers, and the time of a query.
"""

METHOD = """\
## Method

- **Command.** `make accuracy` installs the peers (`make peers`), measures for some minutes and
  writes this page, the CSV file and the plots. `python -m benchmarks.accuracy --help` tells the
  options.
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
- **What is stated of the tiers** is a power of ten, 4 to 40 times the worst error seen, since
  other processors round in other ways; 1e-14 m is the rounding of coordinates of up to 5 m.
  `test/numerics/test_precision_table.py` holds the file to it in both directions: a larger error
  fails, and so does one a hundred times smaller, since the file is then out of date.
- **Random searches.** `test/numerics/search.py` makes pairs of any two of the eight shapes, random
  or nasty: nearly aligned, concentric, just touching, a millionth as large, a thousand kilometres
  away. It asks about each pair as it is, with A and B exchanged, and with B moved by a nanometre.
  A fault is an exception, NaN, a normal that is no unit vector, a witness off its surface, a
  normal that does not separate by the distance, another direction that separates more, an answer
  that depends on the order, or a change larger than the motion; all by more than 1e-9 of the size.
  Meshes measured by their triangles (`--meshes`) are judged by what [meshes.md](meshes.md)
  promises.
- **What searches found.** The first runs, of 333 334 pairs each, found up to eight faults, all
  mended. The seven runs of that length since then found none and an eighth found one, the last
  below; six more since that was mended, and four shorter ones, of 333 334 pairs together, found
  none. Fourteen runs with meshes measured by their triangles, of 533 334 pairs together, found
  three faults, all mended; the last four, of 40 000 pairs each, found none. The 143 pairs with a
  fault, and one that a change in the making had, are kept in `test/support/hard_corpus/`, and
  every test run asks about them.
- **No fault is known.** The last ones were hulls with faces parallel to 1e-7 rad, off by up to
  6.5e-9 of their size (`test/numerics/test_borders.py` makes more of them); a corner that touches
  an edge of a mesh, with a normal that only one of the two triangles there allows; and cylinders
  a micrometre large and a third of a metre apart, off by 2e-15 m.
- **Engines.** Called from Python, on one thread. The tiers: one call for a scene of many such
  pairs, candidates included, divided by their number. `exact, one by one`, Drake, Coal, FCL and
  MuJoCo: one call for each pair, poses given before. Penetrations of Drake and MuJoCo come from
  one call for the scene, which is what they offer. Tolerances are each library's defaults but
  where the name says otherwise; Drake and FCL have none to set from Python. MuJoCo keeps the
  vertices of meshes in single precision.
- **Times** are the fastest of five rounds, for one query. They depend on the machine, so compare
  them only with each other.
- **No answer** means that the engine raises, has no such query, or returns NaN, infinity or a
  sentinel. An overlap that an engine doesn't see counts with its full depth.

![Error against time of a query, 2 mm deep](accuracy_deep.png)
"""
