"""The part of a scene graph that is about the settings of a model: accuracy and defaults."""

from __future__ import annotations

from typing import Any

from scene_graph_ros.geometry.accuracy import Accuracy, as_accuracy, as_engine, Engine
from scene_graph_ros.geometry.model.context import Context
from scene_graph_ros.geometry.model.edit import Edit
from scene_graph_ros.geometry.model.owner import ModelOwner
from scene_graph_ros.geometry.model.proximity import with_proximity
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.scene_config import SceneGraphConfig
from scene_graph_ros.geometry.property_errors import PropertyValueError
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["SceneSettings", "checked_config"]


def _set(edit: Edit, setting: str, value: Any) -> None:
    """Set the defaults of queries."""
    edit.set(edit.state, setting, value)
    edit.changed()


def _set_config(edit: Edit, config: SceneGraphConfig) -> None:
    """Set a model's values of contact, and give them to the geometry that is there."""
    state = edit.state
    for geometry_id in state.with_role[Role.PROXIMITY]:
        record = state.geometries[geometry_id]
        assert record.given is not None
        changed = with_proximity(record, record.given, config)
        edit.put((state.geometries, geometry_id, changed))
    edit.set(state, "config", config)
    edit.changed(Role.PROXIMITY)


def checked_config(config: Any) -> SceneGraphConfig:
    """Return a configuration, the empty one for None. Raises PropertyValueError."""
    if config is None:
        return SceneGraphConfig()
    if not isinstance(config, SceneGraphConfig):
        raise PropertyValueError(f"config must be a SceneGraphConfig, not {quoted(config)}")
    return config


class SceneSettings:
    """How a model's queries are answered, and what its geometry gets where nothing was said."""

    def _owner(self, context: Context | None) -> ModelOwner:
        raise NotImplementedError

    @property
    def accuracy(self) -> Accuracy:
        """The tier of the model's queries."""
        return self._owner(None).state.accuracy

    @property
    def engine(self) -> Engine:
        """The engine of the model's queries about pairs."""
        return self._owner(None).state.engine

    def set_accuracy(self, accuracy: Accuracy | str, *, context: Context | None = None) -> None:
        """Choose another tier for the model's queries. Raises QueryArgumentError."""
        self._owner(context).change(_set, "accuracy", as_accuracy(accuracy))

    def set_engine(self, engine: Engine | str, *, context: Context | None = None) -> None:
        """Choose another engine for the model's queries. Raises as the constructor does."""
        self._owner(context).change(_set, "engine", as_engine(engine))

    def get_config(self, context: Context | None = None) -> SceneGraphConfig:
        """Return the configuration of the model, or of a context's."""
        return self._owner(context).state.config

    def set_config(self, config: SceneGraphConfig, *, context: Context | None = None) -> None:
        """Set the values of contact for geometry that has none, there already or added later.

        Each geometry keeps what it was given: another configuration takes the place of what the
        one before has added. Raises PropertyValueError for other objects, and PropertyError for a
        geometry which lacks something with it; then nothing has changed.
        """
        if config is None:
            raise PropertyValueError("config must be a SceneGraphConfig, not None")
        self._owner(context).change(_set_config, checked_config(config))
