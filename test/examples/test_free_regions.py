"""The example that grows regions: each is proven, kept, and drawn where that is wanted."""

from pathlib import Path
import re
import sys

from PIL import Image as Picture
import pytest

from scene_graph_ros.geometry.optimization import load_iris_regions_yaml_file

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "examples"))

from free_regions import main  # noqa: E402

SCENE = """
version: 1
sources: [{name: cell}]
geometries:
  - name: pillar
    source: cell
    pose: {xyz: [0.4, 0.0, 0.5]}
    shape: {type: cylinder, radius: 0.1, length: 1.0}
  - name: crate
    source: cell
    pose: {xyz: [-0.3, 0.2, 0.2]}
    shape: {type: box, size: [0.2, 0.2, 0.4]}
"""


@pytest.mark.parametrize("is_drawn", [False, True])
def test_regions_are_proven_kept_and_drawn(tmp_path, capsys, is_drawn):
    """Of a scene file of one's own, from samples of one's own."""
    scene, regions, picture = (tmp_path / f"a.{end}" for end in ("yaml", "regions", "png"))
    scene.write_text(SCENE)
    options = ["--scene", scene, "--regions", regions, "--output", picture, "--width", "80"]
    options += ["--sample", 0.0, 0.0, 1.2, "--sample", 0.0, -0.5, 0.3]
    options += [] if is_drawn else ["--no-picture"]
    assert main([str(option) for option in options]) == 0
    told = capsys.readouterr().out
    assert re.findall(r"(\d+) of (\d+) obstacles proven to be outside", told) == [("2", "2")] * 2
    found = load_iris_regions_yaml_file(regions)
    assert list(found) == ["region 1", "region 2"]
    assert found["region 2"].point_in_set([0.0, -0.5, 0.3])
    assert not found["region 2"].point_in_set([0.4, 0.0, 0.5])
    assert picture.exists() == is_drawn
    if is_drawn:
        with Picture.open(picture) as image:
            assert image.size[0] == 80
            assert image.getextrema() != image.convert("L").convert("RGB").getextrema()


def test_a_sample_in_an_obstacle_is_named(tmp_path):
    """And nothing is written."""
    scene = tmp_path / "a.yaml"
    scene.write_text(SCENE)
    from scene_graph_ros.geometry.optimization import ConvexSetError

    with pytest.raises(ConvexSetError, match=r"obstacles\[1\]"):
        main(["--scene", str(scene), "--sample", "-0.3", "0.2", "0.2", "--no-picture"])
