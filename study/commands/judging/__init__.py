"""Commands that hand numbers on, compare them, and say what they mean and how far they hold."""
