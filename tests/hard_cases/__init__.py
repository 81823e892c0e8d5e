"""Hard cases: whatever a user can write gives a right answer or ends with a named outcome and advice.

One file `test_*.py` per family. Each holds a table of cases, the invariants that hold after every event or step (see
tests/physics.py), and a function

    rows() -> list[Row]        (tests.hard_cases.table.Row: family, tried, invariant, worst, outcome)

that runs its table and says what was tried and the worst value seen. `python -m tests.hard_cases` collects the rows of all
families into tests/hard_cases/table.md.
"""
