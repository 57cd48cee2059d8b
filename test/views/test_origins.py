"""Which pages of elsewhere a parameter lets in."""

import pytest

from scene_graph_ros.views.origins import origins_of


def test_origins_are_separated_by_commas():
    """As browsers send them, without regard to case and spaces."""
    assert origins_of("") == ()
    assert origins_of(" HTTPS://app.foxglove.dev , file://,") == (
        "https://app.foxglove.dev",
        "file://",
    )
    assert origins_of("http://[::1]:8080") == ("http://[::1]:8080",)


@pytest.mark.parametrize(
    "text", ["*", "app.foxglove.dev", "https://a.example/", "https://a.example/x", "null", "a b"]
)
def test_what_is_no_origin_is_refused(text):
    """With the text, and what one looks like; nothing stands for all of them."""
    with pytest.raises(ValueError, match=r"no origin.*https://app\.foxglove\.dev"):
        origins_of(f"file://,{text}")
