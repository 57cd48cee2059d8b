"""From a proposal to the exact contact: the features that touch, solved by Newton's method."""
