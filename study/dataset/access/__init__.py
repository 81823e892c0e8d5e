"""Getting at the data: one case of a dataset, all of its events, several datasets as one."""
