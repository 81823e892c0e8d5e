"""
Sizes of events
===============

How large are the events, and do their sizes follow a power law?

One case without a campaign: its record, the sizes of its events once the pin slides, and the law that describes them
best. Each line is the share of events that are at least so large. A power law would be straight; goodness is the
share of its samples that fit it worse than the events do, below 0.1 it is none.
"""

import nanoslip

case = nanoslip.Case(intrinsic_friction=0.5, radius=200.0, slab=nanoslip.Slab(n_x=129), max_events=10_000)
record = nanoslip.friction_record(case)
sizes = nanoslip.event_sizes(record, beyond=nanoslip.plateau_of(record).start)
axes = sizes.plot()
axes.set(xlim=(1e-3, None))
print(record, sizes, nanoslip.size_distribution(sizes.slips, discrete=True), sep="\n")
