"""Results -> dataset: where each case lies, the table over the cases, the runs one behind the other."""
