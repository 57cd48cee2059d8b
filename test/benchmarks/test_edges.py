"""The benchmark of edges counts what samples miss, and draws it beside the proof."""

from benchmarks import edge_errors, edges
from benchmarks.edge_errors import read


def test_samples_miss_fewer_edges_the_finer_they_are(tmp_path, capsys, monkeypatch):
    """Each halving keeps the samples of before; the proof misses nothing."""
    monkeypatch.setattr(edge_errors, "_REPEATS", 1)
    monkeypatch.setattr(edges, "_REPEATS", 1)
    monkeypatch.setattr(edges, "_HALVINGS", 6)
    monkeypatch.setattr(edges, "SCENES", {"rod": edge_errors.SCENES["a rod among posts of 1 mm"]})
    edges.main(["--count", "400", "--out", str(tmp_path)])
    proof, *samples = read(tmp_path / "edges.csv")
    assert proof.step == 0.0 and proof.wrong == 0 and 100 < proof.colliding < proof.edges <= 400
    wrong = [row.wrong for row in samples]
    assert len(wrong) == 7 and wrong == sorted(wrong, reverse=True)
    # A post and the rod are 1 mm thick, and steps of 0.4 rad of a metre are 400 mm.
    assert wrong[0] > 0.9 * proof.colliding and wrong[-1] < 0.6 * proof.colliding
    assert [row.step for row in samples] == [0.4 / 2**k for k in range(7)]
    picture = tmp_path / "edges.png"
    drawn = picture.read_bytes()
    picture.unlink()
    edges.main(["--picture-only", "--out", str(tmp_path)])
    assert picture.read_bytes() == drawn
    assert "rod" in capsys.readouterr().out
