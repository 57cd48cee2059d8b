"""The regions that the node keeps, imported and made with the first."""

from __future__ import annotations

from collections.abc import Callable
import threading
from typing import TYPE_CHECKING

from scene_graph_ros.node.world.world import WorldSnapshot

if TYPE_CHECKING:
    from scene_graph_ros.node.world.kept_regions import KeptRegions

__all__ = ["RegionsOnDemand"]


class RegionsOnDemand:
    """Kept regions, or none yet; any thread may ask for them."""

    def __init__(
        self, snapshot: Callable[[], WorldSnapshot], changed: Callable[[int], None]
    ) -> None:
        """Test them against ``snapshot()``; ``changed`` is told their number."""
        self._snapshot, self._changed = snapshot, changed
        self._lock = threading.Lock()
        self.existing: KeptRegions | None = None

    def made(self) -> KeptRegions:
        """Return the kept regions, made now where there are none."""
        from scene_graph_ros.node.world.kept_regions import KeptRegions

        with self._lock:
            if self.existing is None:
                self.existing = KeptRegions(self._snapshot, self._changed)
            return self.existing
