"""Commands that export, compare, verify and explain numbers, and measure their accuracy."""
