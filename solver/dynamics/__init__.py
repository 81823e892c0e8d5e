"""The pin behind a spring, pulled over its friction record (§2.2, §3.3): motion, static and kinetic friction."""
