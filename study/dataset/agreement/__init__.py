"""Two datasets beside each other: which cases both have, whether their numbers agree, what made them differ."""
