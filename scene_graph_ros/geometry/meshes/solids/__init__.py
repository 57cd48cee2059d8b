"""What triangles enclose: parts, cavities and sheets, repaired, united and reported."""
