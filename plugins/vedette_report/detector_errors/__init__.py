"""What returns say of a detector's errors, without truth."""
