"""Where states and tracks are kept."""
