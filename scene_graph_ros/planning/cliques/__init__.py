"""Visibility graphs, their largest cliques, and covers of graphs by cliques."""
