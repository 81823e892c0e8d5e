"""Motion of the pin pulled by a spring over its friction record (§2.2, §3.3), static and kinetic friction."""
