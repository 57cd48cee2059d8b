"""How somebody gets the handle of a source of the scene that a node starts with."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator, StringConstraints

__all__ = ["HandleSpec"]


class HandleSpec(BaseModel):
    """A source's options for its handle. Without one nobody gets it."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    token_file: (
        Annotated[str, StringConstraints(strict=True, strip_whitespace=True, min_length=1)] | None
    ) = Field(
        None,
        description="A file below this one's folder with the token, a number, for the node's user "
        "alone (mode 0600); made at the node's start where it is missing.",
    )
    claim: Literal["first"] | None = Field(
        None,
        description="first: whoever first asks register_source for this name gets the handle. It "
        "trusts everybody who reaches the node.",
    )

    @model_validator(mode="after")
    def _one_key(self) -> HandleSpec:
        if self.token_file is not None and self.claim is not None:
            raise ValueError("give token_file or claim, not both")
        return self
