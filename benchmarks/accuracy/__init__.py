"""How exact are distances, and what does a digit cost? ``python -m benchmarks.accuracy --help``.

Configurations whose answer is known by construction (``constructions``) are put to every engine
that is installed (``ours``, ``peers``); ``measure`` notes the worst error and the time of a query,
``report`` and ``plots`` write ``docs/accuracy.csv``, ``docs/accuracy.md`` and the pictures.
"""
