"""What one step of each computation takes: seconds on one core of an ordinary machine.

A prediction is a number of steps (`counts`) times their rate, to a factor of three. What a machine and a campaign really take is
measured: the first finished tasks of a campaign scale the predictions for the others, kind by kind
(nanoslip.study.execution.forecast).
"""

from typing import Final

TASK: Final = 1e-3
"""Of any task: hand out, read, write."""
NODE: Final = 2e-5
"""Of a slab's grid, whose stiffness is assembled and condensed."""
ENTRY: Final = 2e-8
"""Of a dense matrix that is written and updated."""
SOLVE: Final = 2e-10
"""Of the cube of the unknowns of a dense solution."""
CONTACT: Final = 1e-3
"""Of one search for the contact, besides its solutions."""
CONVOLUTION: Final = 1.5e-7
"""Of a surface node times the binary digits of their number, in a search for the contact without a matrix."""
SLIP: Final = 1e-9
"""Of an entry of the row that a slip of a node adds to the state."""
EVENT: Final = 1e-6
"""Of an event of a record: written, and read for its scalars."""
STATISTICS: Final = 0.7
"""Of the distributions of event sizes of a member: fits of drawn samples."""
STEP: Final = 6e-8
"""Of a drive: a tooth passed, a time step, a sample."""
RINGING: Final = 5e-6
"""Of a drive's time, counted in periods of the contact's own oscillation over 2 π."""
FIT: Final = 1.2e-5
"""Of a sample and a slip in the fit of the closed form."""
