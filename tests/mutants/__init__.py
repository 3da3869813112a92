"""Wrong components that others wrote, and the table of which law catches which."""
