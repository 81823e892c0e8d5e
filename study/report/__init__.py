"""Results for people: tables on the terminal, figures, the HTML page."""
