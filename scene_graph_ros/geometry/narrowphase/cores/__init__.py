"""The answers of each kind of core to the questions of the narrow phase, a file each."""
