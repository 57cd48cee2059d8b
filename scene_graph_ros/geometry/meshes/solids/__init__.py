"""The solids that triangles enclose: parts, cavities and sheets, repaired, united and reported."""
