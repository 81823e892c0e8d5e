"""
Sizes of events
===============

How large are the events, and do their sizes follow a power law?

One case without a campaign: its record, the sizes of its events on the plateau, and the law that fits them best. Each line
is the share of events that are at least so large. A power law is a straight line; with a goodness below 0.1 it is rejected.
"""

import nanoslip

case = nanoslip.Case(intrinsic_friction=0.5, radius=200.0, slab=nanoslip.Slab(n_x=129), max_events=10_000)
record = nanoslip.friction_record(case)
sizes = nanoslip.event_sizes(record, beyond=nanoslip.plateau_of(record).start)
axes = sizes.plot()
axes.set(xlim=(1e-3, None))
print(record, sizes, nanoslip.size_distribution(sizes.slips, discrete=True), sep="\n")
