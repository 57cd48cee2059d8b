"""The reasons why a planner returns no path."""

import enum

__all__ = ["PlanFailure"]


class PlanFailure(enum.Enum):
    """Why there is no path; numbers as in messages, which have more."""

    START_BEYOND_LIMITS = 1
    START_COLLIDES = 2
    GOAL_BEYOND_LIMITS = 3
    """Of all goals at least one is, and the others collide."""
    GOAL_COLLIDES = 4
    """All goals do."""
    TIMEOUT = 5
    """Nothing was found in time."""
    EXHAUSTED = 6
    """The trees grew to their limit and did not meet, or where they met was not proven again."""
    GOAL_UNREACHED = 9
    """No configuration was found that puts the tool where the goal says."""
    START_VIOLATES_CONSTRAINT = 13
    GOAL_VIOLATES_CONSTRAINT = 14
    """Of all goals that are within limits and free."""
