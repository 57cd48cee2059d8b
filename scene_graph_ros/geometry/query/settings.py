"""How queries are to be answered: the model's choice, unless they say otherwise."""

from __future__ import annotations

import functools
from typing import NamedTuple

from scene_graph_ros.geometry.accuracy import Accuracy, as_accuracy, as_engine, Engine
from scene_graph_ros.geometry.errors import EngineError
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.query.arguments import checked_flag

__all__ = ["Settings", "settings_of"]


class Settings(NamedTuple):
    """The settings of a query about pairs: its accuracy, engine and columns."""

    accuracy: Accuracy
    engine: Engine
    derivatives: bool = False
    certificate: bool = False


_plain = functools.cache(Settings)


def settings_of(
    snapshot: Snapshot,
    accuracy: Accuracy | str | None,
    engine: Engine | str | None,
    derivatives: bool = False,
    certificate: bool = False,
) -> Settings:
    """Return the settings asked for, the model's choice where none were.

    Raises QueryArgumentError for what is no tier, engine or flag, EngineError for columns that the
    engine lacks.
    """
    state = snapshot.state
    if accuracy is engine is None and derivatives is certificate is False:
        return _plain(state.accuracy, state.engine)
    chosen = state.engine if engine is None else as_engine(engine)
    tier = state.accuracy if accuracy is None else as_accuracy(accuracy)
    if chosen is Engine.FCL and accuracy is not None:
        raise EngineError(f"engine 'fcl' has no accuracy to choose: {accuracy!r}")
    if chosen is Engine.FCL and checked_flag("certificate", certificate):
        raise EngineError("engine 'fcl' gives no certificate")
    return Settings(
        tier,
        chosen,
        checked_flag("derivatives", derivatives),
        checked_flag("certificate", certificate),
    )
