"""Commands before a campaign is computed: what there is to start from, whether a file is right, what it would take."""
