"""The parameters of the view in a browser."""

from __future__ import annotations

from scene_graph_ros.node.runtime.parameter import Parameter

__all__ = ["BROWSER_PARAMETERS"]

BROWSER_PARAMETERS: tuple[Parameter, ...] = (
    Parameter(
        "browser",
        False,
        "Whether to serve a page that shows the world.",
        read_only=True,
    ),
    Parameter(
        "browser_host",
        "127.0.0.1",
        "Address that the page is served on; any but this machine's own takes a token.",
        read_only=True,
    ),
    Parameter(
        "browser_port",
        8780,
        "Port that the page is served on; 0: a free one, which the log says.",
        minimum=0,
        maximum=65535,
        read_only=True,
    ),
    Parameter(
        "browser_required",
        True,
        "Whether the node ends at its start where it can't serve the page, or goes on without.",
        read_only=True,
    ),
    Parameter(
        "browser_token",
        "",
        "What the page's address must have as ?token=; empty: nothing; new: one that the node "
        "makes at its start. The log says which file leads to the address.",
        read_only=True,
        is_secret=True,
    ),
    Parameter(
        "browser_control",
        False,
        "Whether pages may move joints that nobody else publishes, drag links of robots and plan"
        " motions; takes a browser_token.",
        read_only=True,
    ),
    Parameter(
        "browser_execute",
        False,
        "Whether pages may publish motions that were planned for them on ~/trajectory; takes"
        " browser_control.",
        read_only=True,
    ),
    Parameter(
        "browser_acceleration",
        5.0,
        "rad/s^2 or m/s^2. Largest acceleration of each joint in motions that pages plan.",
        minimum=1e-3,
        maximum=1e4,
    ),
    Parameter(
        "browser_jerk",
        100.0,
        "rad/s^3 or m/s^3. Largest jerk of each joint in motions that pages plan.",
        minimum=1e-3,
        maximum=1e6,
    ),
    Parameter(
        "browser_origins",
        "",
        "Origins of other pages that may read, by commas, such as https://app.foxglove.dev.",
        read_only=True,
    ),
    Parameter(
        "browser_rate",
        30.0,
        "Hz. A page is told what moved at most this often.",
        minimum=0.01,
        maximum=1000.0,
        read_only=True,
    ),
)
