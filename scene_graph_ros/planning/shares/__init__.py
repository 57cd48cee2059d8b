"""Work that is shared out among other processes and machines."""
