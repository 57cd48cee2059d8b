"""Work that is shared out among threads, processes and machines."""
