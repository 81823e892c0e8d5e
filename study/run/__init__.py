"""How tasks are computed: in this process, in several, or on all ranks of an MPI job; each may die without the others."""
