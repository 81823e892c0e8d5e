"""
The paper's figures
===================

How do I draw the figures of Streator (2022), and what differs?
"""

# %%
# One command computes and draws a figure, with a table of the paper's numbers and ours. Without names it lists all
# figures; ``--all`` draws them in some twenty minutes.
from subprocess import check_output

print(check_output("nanoslip figure", shell=True, text=True))

# %%
# Figures 6 and 7: friction over displacement, and the displacement for each event.
print(check_output("nanoslip figure fig6 fig7 --into results --format png", shell=True, text=True))

# %%
# **What it means.** Plateaus and coefficients agree with the paper to 2-8 %; remarks give reasons for differences.
# The manifests are the shipped campaigns ``figures/...`` (``nanoslip campaigns``).
#
# **What it costs.** Seconds for each figure; ``choices`` and ``continuum`` a quarter of an hour each.
