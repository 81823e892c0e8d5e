"""Commands that show what came out, as page, figure, text or film."""
