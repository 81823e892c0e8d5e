"""Results of tasks on disk: whole, sealed, found again; and what is known of tasks that failed."""
