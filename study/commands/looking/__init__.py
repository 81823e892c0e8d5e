"""Commands that show results as a page, figure, text or film."""
