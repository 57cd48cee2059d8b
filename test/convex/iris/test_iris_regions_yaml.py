"""Regions as YAML: each number as it was, entries that are wrong named."""

import numpy as np
import pytest

from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    HPolyhedron,
    load_iris_regions_yaml_file,
    Point,
    save_iris_regions_yaml_file,
)

WRITTEN_ELSEWHERE = """
shelf:
  top: {ambient_dimension: 2, A: [[1, 0], [0, 1e-7], [-.5, -1]], b: [1, 2.5e+1, 0]}
  bottom:
    A:
      - [1.0, 0.0]
    b: [-3.0]
"""


def test_numbers_are_read_as_they_were(tmp_path):
    """Tiny, huge, with all digits, without rows; in their order, below a key or not."""
    rng = np.random.default_rng(3)
    regions = {
        "b": HPolyhedron(
            rng.normal(size=(40, 7)) * 10.0 ** rng.integers(-30, 30, (40, 7)), np.ones(40)
        ),
        "a": HPolyhedron.make_unit_box(3),
        "all": HPolyhedron(np.zeros((0, 3)), []),
        "1": HPolyhedron([[0.1 + 0.2]], [-0.0]),
    }
    path = tmp_path / "regions.yaml"
    for child in (None, "below"):
        save_iris_regions_yaml_file(path, regions, child)
        found = load_iris_regions_yaml_file(path, child)
        assert list(found) == list(regions)
        for name, region in regions.items():
            assert found[name].A.tobytes() == region.A.tobytes()
            assert found[name].A.shape == region.A.shape
            assert found[name].b.tobytes() == region.b.tobytes()


def test_files_of_other_programs(tmp_path):
    """Numbers without a point or with a short exponent, rows on lines, no dimension."""
    path = tmp_path / "regions.yaml"
    path.write_text(WRITTEN_ELSEWHERE)
    found = load_iris_regions_yaml_file(path, "shelf")
    np.testing.assert_array_equal(found["top"].A, [[1.0, 0.0], [0.0, 1e-7], [-0.5, -1.0]])
    np.testing.assert_array_equal(found["top"].b, [1.0, 25.0, 0.0])
    assert found["bottom"].b[0] == -3.0


def test_drake_reads_and_writes_the_same_files(tmp_path):
    """Each number of ours is read by it, and each of its own by us."""
    theirs = pytest.importorskip("pydrake.geometry.optimization", reason="make peers installs it")
    rng = np.random.default_rng(8)
    regions = {
        f"region {k}": HPolyhedron(rng.normal(size=(9, k + 2)), rng.uniform(size=9))
        for k in range(3)
    }
    path = tmp_path / "regions.yaml"
    for child in (None, "below"):
        save_iris_regions_yaml_file(path, regions, child)
        read = theirs.LoadIrisRegionsYamlFile(str(path), child)
        assert list(read) == list(regions)
        theirs.SaveIrisRegionsYamlFile(str(path), read, child)
        found = load_iris_regions_yaml_file(path, child)
        for name, region in regions.items():
            for each in ((read[name].A(), read[name].b()), (found[name].A, found[name].b)):
                np.testing.assert_array_equal(each[0], region.A)
                np.testing.assert_array_equal(each[1], region.b)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[1, 2]", "must be a mapping of names"),
        ("a: 2020-13-45", "regions.yaml: no YAML: month must be in 1..12"),
        pytest.param("[" * 20_000, "regions.yaml: no YAML: ", id="deep"),
        ("a: {A: 7, b: 1}", r"A has the shape \(\), ambient_dimension is None"),
        pytest.param("a: {A: 1" + 400 * "0" + ", b: 1}", "must be rows of numbers", id="long"),
        ("a: {A: [], b: [], ambient_dimension: 99999999}", "ambient_dimension is 99999999"),
        ("a: {A: [[1]], b: [1], ambient_dimension: true}", "ambient_dimension is True"),
        ("top: 3", "top has no 'A'"),
        ("top: {A: [[1]]}", "top has no 'b'; it has A"),
        ("top: {A: [[1], [1, 2]], b: [1]}", "top: A and b must be rows of numbers"),
        ("top: {A: [[one]], b: [1]}", "top: A and b must be rows of numbers"),
        ("top: {ambient_dimension: 3, A: [[1]], b: [1]}", "ambient_dimension is 3"),
        ("top: {A: [[1]], b: [1, 2]}", "b must have the shape"),
        ("top: {A: [[.nan]], b: [1]}", "finite"),
        ("top: {A: [", "no YAML"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, text, message):
    """The file, the entry, and what it has."""
    path = tmp_path / "regions.yaml"
    path.write_text(text)
    with pytest.raises(ConvexSetError, match=message):
        load_iris_regions_yaml_file(path)


def test_a_key_that_is_not_there_is_named(tmp_path):
    """And those that are."""
    path = tmp_path / "regions.yaml"
    path.write_text(WRITTEN_ELSEWHERE)
    with pytest.raises(ConvexSetError, match="no 'table'; it has shelf"):
        load_iris_regions_yaml_file(path, "table")


def test_only_regions_are_written(tmp_path):
    """The name of what is none is said, and nothing is written."""
    path = tmp_path / "regions.yaml"
    with pytest.raises(ConvexSetError, match=r"regions\['top'\] must be an HPolyhedron"):
        save_iris_regions_yaml_file(path, {"top": Point([1.0])})
    assert not path.exists()
