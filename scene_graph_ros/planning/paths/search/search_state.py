"""The state of a search's kernels between edges, and their answers."""

__all__ = [
    "CONNECT",
    "COUNT",
    "DONE",
    "EDGES",
    "ENTRIES",
    "EXTEND",
    "FIRST",
    "JOINED",
    "LOOKS",
    "NEAR",
    "NEEDS_ROOM",
    "NEEDS_SAMPLES",
    "PAUSED",
    "PHASE",
    "PROVE",
    "REACHES",
    "ROOTS",
    "SAMPLE",
    "SHORTEN",
    "STOPPED",
    "TARGET",
    "TREE",
]

(
    PHASE,
    TREE,  # that grows: 0 begins at the start, 1 at the goals
    NEAR,  # its node that an edge begins at; once they have met, where
    TARGET,  # the node of the other tree that it leads to
    REACHES,  # whether the edge ends there
    ROOTS,  # how many goals are still to be tried without a detour
    SAMPLE,  # the next random number, or configuration
    EDGES,  # how many edges were looked at
    COUNT,  # how many configurations the path has that is shortened
    FIRST,  # the corner of the path that is to be cut off
    LOOKS,  # configurations that may be looked at before the next pause
    ENTRIES,
) = range(12)
"""The entries of a search's state ``(ENTRIES,)``."""

CONNECT, EXTEND, JOINED, SHORTEN = range(4)
"""Phases: walk to the other tree; step to a sample; the trees have met; shorten the path."""

PROVE, DONE, NEEDS_SAMPLES, NEEDS_ROOM, STOPPED, PAUSED = range(6)
"""Answers: an edge is to be proven; there is nothing left to do; what is missing; told to stop;
enough was looked at for now."""
