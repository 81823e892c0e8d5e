"""Computation of tasks: in this process, in several, or on all ranks of an MPI job; each may die without the others."""
