"""What each kind of core answers to the questions of the narrow phase, a file each."""
