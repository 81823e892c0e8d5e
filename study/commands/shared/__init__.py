"""Pieces that several commands use: arguments, exit codes, messages, printed tables, the root's part of a run."""
