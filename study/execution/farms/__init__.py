"""Farms: processes that compute tasks, here, or over ranks of MPI. Each owns children that compute and may die of it."""
