"""Tasks over processes: queue, load balancing, MPI, progress, signals, batch scripts."""
