"""Calls of public functions of convex sets, scenes and cameras with small arrays."""

from __future__ import annotations

import numpy as np
from soft_bodies import soft_instance, WORLD

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    GeometrySet,
    HalfSpace,
    HeightField,
    Mesh,
    PerceptionProperties,
    PointCloud,
    ProximityProperties,
    QueryObject,
    SceneGraph,
    Sphere,
    SurfaceMesh,
    VoxelGrid,
)
from scene_graph_ros.geometry.optimization import (
    AffineBall,
    AffineSubspace,
    CartesianProduct,
    Cone,
    ConicProgram,
    FunctionConstraint,
    GraphOfConvexSets,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    iris,
    Point,
    positive_semidefinite,
    quad_form,
    Spectrahedron,
    VPolytope,
)
from scene_graph_ros.geometry.perception import (
    CameraDescription,
    CameraIntrinsics,
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    EnvironmentMap,
    ExactRenderEngine,
    RenderCameraCore,
)

__all__ = ["CALLS"]

TURNED = [[0.0, 0, 1, 3], [1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 0, 1]]
POINTS = [[0.0, 0], [4, 0], [0, 4]]
HEIGHTS = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
CORNERS = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
ROWS, SIDES = [[1.0, 0], [0, 1], [-1, -1]], [2.0, 3, 1]
DIAGONAL, CENTER = [[2.0, 0], [0, 4]], [1.0, 2]
SYMMETRIC = [[[1.0, 0], [0, 1]], [[0.0, 1], [1, 0]]]
LOW, HIGH = [0.0, 1], [2.0, 4]
BOX = Hyperrectangle([0, 0], [3, 3])
LENS = CameraIntrinsics(4, 3, 4.0, 4.0, 2.0, 1.5)


class Scene:
    """Two balls on frames, a pad that deforms, and a camera's renderer."""

    def __init__(self):
        self.graph = SceneGraph()
        self.source = self.graph.register_source("s")
        self.frames = [
            self.graph.register_frame(self.source, GeometryFrame(f"f{k}")) for k in range(2)
        ]
        self.balls = []
        for frame in self.frames:
            ball = GeometryInstance(np.eye(4), Sphere(0.5), "ball")
            ball.set_proximity_properties(ProximityProperties())
            ball.set_perception_properties(PerceptionProperties())
            self.balls.append(self.graph.register_geometry(self.source, frame, ball))
        self.pad = self.graph.register_deformable_geometry(self.source, WORLD, soft_instance())
        self.graph.add_renderer("eye", ExactRenderEngine())
        self.context = self.graph.create_default_context()
        self.query = self.graph.query_object(self.context)

    def moved(self, poses):
        """Return where frames are that were set."""
        self.context.set_frame_poses(self.source, poses)
        return self.context.frame_poses(self.source)

    def moved_one(self, X_PF):
        """Return where a frame is that was set."""
        self.context.set_frame_pose(self.source, self.frames[0], X_PF)
        return self.context.frame_pose(self.frames[0])

    def deformed(self, configurations):
        """Return where vertices are that were set."""
        self.context.set_configurations(self.source, {self.pad: configurations})
        return self.context.configuration(self.pad)

    def with_points(self, points):
        """Return points that were set of a cloud, which has no role."""
        graph = self.graph.clone()
        cloud = GeometryInstance(np.eye(4), PointCloud(CORNERS, 0.1), "cloud")
        cloud_id = graph.register_geometry(self.source, self.frames[0], cloud)
        context = graph.create_default_context()
        context.set_points(self.source, {cloud_id: points})
        return context.points(cloud_id)

    def with_heights(self, heights):
        """Return heights that were set of a field, which has no role."""
        graph = self.graph.clone()
        field = GeometryInstance(np.eye(4), HeightField(np.zeros((2, 3)), (1, 1), -1.0), "field")
        field_id = graph.register_geometry(self.source, self.frames[0], field)
        context = graph.create_default_context()
        context.set_heights(self.source, {field_id: heights})
        return context.heights(field_id)

    def with_voxels(self, voxels):
        """Return voxels that were set of a grid, which has no role."""
        graph = self.graph.clone()
        grid = GeometryInstance(np.eye(4), VoxelGrid([[[0]]], 0.1), "grid")
        grid_id = graph.register_geometry(self.source, self.frames[0], grid)
        context = graph.create_default_context()
        context.set_voxels(self.source, {grid_id: voxels})
        return context.voxels(grid_id)

    def hung(self, X_FG):
        """Return where a geometry hangs whose pose was changed."""
        graph = self.graph.clone()
        graph.change_shape(self.source, self.balls[0], Sphere(0.25), X_FG)
        return graph.model_inspector().get_pose_in_frame(self.balls[0])

    def seen(self, how, X_PC):
        """Return an image from a pose of a camera."""
        core = camera_core(np.eye(4))
        color = ColorRenderCamera(core, False)
        depth = DepthRenderCamera(core, DepthRange(0.1, 9.0))
        camera = color if how in ("render_color_image", "render_label_image") else depth
        return getattr(self.query, how)(camera, self.graph.world_frame_id(), X_PC)


SCENE = Scene()
NUMBER_OF_VERTICES = len(SCENE.context.configuration(SCENE.pad))


def camera_core(X_BS):
    """Return a camera's core whose sensor is so placed."""
    return RenderCameraCore("eye", LENS, ClippingRange(0.01, 10.0), X_BS)


def placed_instance(X_PG):
    """Return a geometry's pose that was set."""
    instance = GeometryInstance(np.eye(4), Sphere(1.0), "ball")
    instance.set_pose(X_PG)
    return instance.pose()


def program(edit):
    """Return what a program of two variables has after an edit."""
    made = ConicProgram()
    x = made.add_variables(2)
    edit(made, x)
    costs = made.cost(np.array([3.0, 5.0]))
    return [(c.cone, c.matrix, c.constant) for c in made.constraints], costs


def of_graph(term):
    """Return what a term of a vertex's point is at a point."""
    vertex = GraphOfConvexSets().add_vertex(BOX, "v")
    made = term(vertex.x)
    cost = getattr(made, "rows", None)
    at = {vertex.id: np.array([1.0, 2.0])}
    return made.at(at) if cost is None else cost.at(at)


def least_slack(lower_bound):
    """Return the least values of slack variables of an edge above a bound."""
    graph = GraphOfConvexSets()
    ends = [graph.add_vertex(BOX, name) for name in "uv"]
    edge = graph.add_edge(*ends)
    s = edge.new_slack_variables(2, "s", lower_bound, HIGH)
    edge.add_cost(s[0] + s[1])
    return edge.get_solution_slack_variables(graph.solve_convex_restriction([edge]))


def sampled(**more):
    """Return a point of a box, drawn the same way each time."""
    return BOX.make_h_polyhedron().uniform_sample(np.random.default_rng(1), **more)


CALLS = {
    "AffineBall.__init__": (
        lambda B, center: AffineBall(B, center).B,
        {"B": DIAGONAL, "center": CENTER},
    ),
    "AffineBall.make_axis_aligned": (
        lambda radius, center: AffineBall.make_axis_aligned(radius, center).B,
        {"radius": CENTER, "center": CENTER},
    ),
    "AffineBall.make_hypersphere": (
        lambda center: AffineBall.make_hypersphere(2.0, center).center,
        {"center": CENTER},
    ),
    "AffineBall.minimum_volume_circumscribed_ellipsoid": (
        lambda points: AffineBall.minimum_volume_circumscribed_ellipsoid(points).center.round(6),
        {"points": POINTS},
    ),
    "AffineSubspace.__init__": (
        lambda basis, translation: AffineSubspace(basis, translation).translation,
        {"basis": [[1.0], [0]], "translation": CENTER},
    ),
    "AffineSubspace.to_global_coordinates": (
        lambda y: AffineSubspace([[1.0, 0], [0, 1], [1, 1]], [1.0, 2, 3]).to_global_coordinates(y),
        {"y": CENTER},
    ),
    "AffineSubspace.to_local_coordinates": (
        lambda x: AffineSubspace([[1.0], [0]], CENTER).to_local_coordinates(x),
        {"x": CENTER},
    ),
    "AffineBall.make_affine_ball_from_line_segment": (
        lambda x_1, x_2: AffineBall.make_affine_ball_from_line_segment(x_1, x_2).center,
        {"x_1": LOW, "x_2": HIGH},
    ),
    "CartesianProduct.__init__": (
        lambda A, b: CartesianProduct([BOX], A=A, b=b).point_in_set([1.0, 1.0]),
        {"A": DIAGONAL, "b": CENTER},
    ),
    "ConvexSet.point_in_set": (BOX.point_in_set, {"x": CENTER}),
    "ConvexSet.projection": (lambda points: BOX.projection(points).points, {"points": POINTS}),
    "ConvexSet.support": (lambda direction: BOX.support(direction).point, {"direction": CENTER}),
    "Costly.new_slack_variables": (least_slack, {"lower_bound": LOW}),
    "FunctionConstraint.__init__": (
        lambda lower_bound: FunctionConstraint(lambda x: x, lower_bound, HIGH).lower,
        {"lower_bound": LOW},
    ),
    "HPolyhedron.__init__": (lambda A, b: HPolyhedron(A, b).A, {"A": ROWS, "b": SIDES}),
    "HPolyhedron.make_box": (
        lambda lb, ub: HPolyhedron.make_box(lb, ub).b,
        {"lb": LOW, "ub": HIGH},
    ),
    "HPolyhedron.scale": (
        lambda center: BOX.make_h_polyhedron().scale(2.0, center).b,
        {"center": CENTER},
    ),
    "HPolyhedron.uniform_sample": (
        lambda previous_sample, subspace: sampled(
            previous_sample=previous_sample, subspace=subspace
        ),
        {"previous_sample": CENTER, "subspace": [[1.0], [0]]},
    ),
    "HPolyhedron.simplify_by_incremental_face_translation": (
        lambda points_to_contain: (
            HPolyhedron(ROWS, SIDES)
            .simplify_by_incremental_face_translation(
                max_iterations=1, points_to_contain=points_to_contain
            )
            .A.shape
        ),
        {"points_to_contain": [[0.0, 1], [1, 0]]},
    ),
    "Hyperellipsoid.__init__": (
        lambda A, center: Hyperellipsoid(A, center).A,
        {"A": DIAGONAL, "center": CENTER},
    ),
    "Hyperellipsoid.make_axis_aligned": (
        lambda radius, center: Hyperellipsoid.make_axis_aligned(radius, center).A,
        {"radius": CENTER, "center": CENTER},
    ),
    "Hyperellipsoid.make_hypersphere": (
        lambda center: Hyperellipsoid.make_hypersphere(2.0, center).center,
        {"center": CENTER},
    ),
    "Hyperellipsoid.minimum_volume_circumscribed_ellipsoid": (
        lambda points: Hyperellipsoid.minimum_volume_circumscribed_ellipsoid(points).center.round(
            6
        ),
        {"points": POINTS},
    ),
    "Hyperrectangle.__init__": (
        lambda lb, ub: Hyperrectangle(lb, ub).lb,
        {"lb": LOW, "ub": HIGH},
    ),
    "Point.__init__": (lambda x: Point(x).x, {"x": CENTER}),
    "Spectrahedron.__init__": (
        lambda F, A, b, E, f: Spectrahedron(F, A=A, b=b, E=E, f=f).point_in_set([0.5]),
        {"F": SYMMETRIC, "A": [[1.0]], "b": [1.0], "E": [[0.0]], "f": [0.0]},
    ),
    "VPolytope.__init__": (lambda vertices: VPolytope(vertices).vertices, {"vertices": POINTS}),
    "VPolytope.make_box": (
        lambda lb, ub: VPolytope.make_box(lb, ub).vertices,
        {"lb": LOW, "ub": HIGH},
    ),
    "iris": (
        lambda sample: iris([Point([9.0, 9.0])], sample, BOX.make_h_polyhedron()).b.round(6),
        {"sample": CENTER},
    ),
    "positive_semidefinite": (
        lambda F: of_graph(lambda x: positive_semidefinite(F, x)),
        {"F": [[[1.0, 0], [0, 1]], *SYMMETRIC]},
    ),
    "quad_form": (lambda Q: of_graph(lambda x: quad_form(x, Q)), {"Q": DIAGONAL}),
    "ConicProgram.add_linear_cost": (
        lambda c: program(lambda made, x: made.add_linear_cost(c, x)),
        {"c": CENTER},
    ),
    "ConicProgram.add_linear_equations": (
        lambda A, b: program(lambda made, x: made.add_linear_equations(A, b, x)),
        {"A": DIAGONAL, "b": CENTER},
    ),
    "ConicProgram.add_linear_inequalities": (
        lambda A, b: program(lambda made, x: made.add_linear_inequalities(A, b, x)),
        {"A": DIAGONAL, "b": CENTER},
    ),
    "ConicProgram.add_second_order_cone": (
        lambda A, b: program(lambda made, x: made.add_second_order_cone(A, b, x)),
        {"A": ROWS, "b": SIDES},
    ),
    "ConicProgram.add_exponential_cone": (
        lambda A, b: program(lambda made, x: made.add_exponential_cone(A, b, x)),
        {"A": ROWS, "b": SIDES},
    ),
    "ConicProgram.add_positive_semidefinite": (
        lambda F: program(lambda made, x: made.add_positive_semidefinite(F, x)),
        {"F": [[[1.0, 0], [0, 1]], *SYMMETRIC]},
    ),
    "ConicProgram.add_constraint": (
        lambda matrix, constant: program(
            lambda made, x: made.add_constraint(Cone.NONNEGATIVE, matrix, constant, x)
        ),
        {"matrix": DIAGONAL, "constant": CENTER},
    ),
    "Context.set_frame_pose": (SCENE.moved_one, {"X_PF": TURNED}),
    "Context.set_frame_poses": (SCENE.moved, {"poses": [TURNED, TURNED]}),
    "Context.set_configurations": (
        SCENE.deformed,
        {"configurations": np.arange(3.0 * NUMBER_OF_VERTICES).reshape(-1, 3).tolist()},
    ),
    "GeometryInstance.__init__": (
        lambda X_PG: GeometryInstance(X_PG, Sphere(1.0), "x").pose(),
        {"X_PG": TURNED},
    ),
    "GeometryInstance.set_pose": (placed_instance, {"X_PG": TURNED}),
    "SceneGraph.change_shape": (SCENE.hung, {"X_FG": TURNED}),
    "HalfSpace.make_pose": (
        HalfSpace.make_pose,
        {"Hz_dir_F": [0.0, 3, 4], "p_FB": [1.0, 2, 3]},
    ),
    "Mesh.__init__": (
        lambda vertices, faces: (
            Mesh(vertices=vertices, faces=faces).vertices,
            Mesh(vertices=vertices, faces=faces).faces,
        ),
        {"vertices": CORNERS, "faces": [[0, 2, 1], [0, 1, 3]]},
    ),
    "SurfaceMesh.__init__": (
        lambda vertices, triangles: SurfaceMesh(vertices, triangles).vertices,
        {"vertices": CORNERS, "triangles": [[0, 2, 1], [0, 1, 3]]},
    ),
    "SurfaceMesh.calc_barycentric": (
        lambda p_MQ: SurfaceMesh(CORNERS, [[0, 1, 2]]).calc_barycentric(p_MQ, 0),
        {"p_MQ": [[1.0, 2, 3], [0, 1, 0]]},
    ),
    "EnvironmentMap.__init__": (
        lambda texture: EnvironmentMap(texture).texture,
        {"texture": [[[1.0, 2, 3], [0, 1, 0]], [[0, 0, 1], [4, 5, 6]]]},
    ),
    "SurfaceMesh.cartesian_from_barycentric": (
        lambda weights: SurfaceMesh(CORNERS, [[0, 1, 2]]).cartesian_from_barycentric(0, weights),
        {"weights": [1.0, 2, 3]},
    ),
    "QueryObject.ask_what_if": (
        lambda configurations: SCENE.query.ask_what_if(
            [{SCENE.frames[0]: configurations}], QueryObject.has_collisions
        ),
        {"configurations": TURNED},
    ),
    "PointCloud.__init__": (
        lambda points, radius: PointCloud(points, radius).points,
        {"points": CORNERS, "radius": [1.0, 2, 3, 4]},
    ),
    "Context.set_points": (SCENE.with_points, {"points": CORNERS}),
    "HeightField.__init__": (
        lambda heights, size: HeightField(heights, size, -1.0).heights,
        {"heights": HEIGHTS, "size": [1.0, 2.0]},
    ),
    "Context.set_voxels": (SCENE.with_voxels, {"voxels": [[[0, 1], [2, 0]]]}),
    "VoxelGrid.__init__": (
        lambda occupancy: VoxelGrid(occupancy, 0.1).occupancy,
        {"occupancy": [[[0, 1], [2, 0]]]},
    ),
    "Context.set_heights": (SCENE.with_heights, {"heights": HEIGHTS}),
    "QueryObject.compute_signed_distance_geometry_to_point": (
        lambda p_WQ: (
            SCENE.query.compute_signed_distance_geometry_to_point(
                p_WQ, GeometrySet(SCENE.frames[0])
            ).distance
        ),
        {"p_WQ": [1.0, 2, 3]},
    ),
    "QueryObject.compute_signed_distance_to_point": (
        lambda p_WQ: SCENE.query.compute_signed_distance_to_point(p_WQ).distance,
        {"p_WQ": [1.0, 2, 3]},
    ),
    "QueryObject.compute_signed_distance_to_points": (
        lambda p_WQs: SCENE.query.compute_signed_distance_to_points(p_WQs).distance,
        {"p_WQs": CORNERS},
    ),
    **{
        f"RenderQueries.{name}": (lambda X_PC, name=name: SCENE.seen(name, X_PC), {"X_PC": TURNED})
        for name in (
            *("render_color_image", "render_depth_image", "render_label_image"),
            "render_images",
        )
    },
    "RenderCameraCore.__init__": (
        lambda X_BS: camera_core(X_BS).X_BS,
        {"X_BS": TURNED},
    ),
    "CameraDescription.__init__": (
        lambda X_PC: (
            CameraDescription(
                "c",
                "s",
                "f",
                X_PC,
                DepthRenderCamera(camera_core(np.eye(4)), DepthRange(0.1, 9.0)),
            ).X_PC
        ),
        {"X_PC": TURNED},
    ),
}
