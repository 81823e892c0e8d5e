"""Hard cases: whatever a user can write gives a right answer or ends with a named outcome and advice.

One file `test_*.py` per family: cases, and the invariants that hold after every event or step (see tests/physics.py).
"""
