"""What numbers of a campaign tell about its parameters: which of them matter, and which values agree with what was measured."""
