"""What tasks cost, before they are computed: seconds on one core, bytes of memory."""
