"""Commands before a campaign is computed: starters, checks of campaign files, and estimates of time and disk."""
