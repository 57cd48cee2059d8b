"""How exact contact surfaces are, ours and Drake's, and what a finer mesh costs in time.

``closed_forms`` has the truth, ``cases`` the pairs of shapes, ``measure`` puts them to engines.
"""
