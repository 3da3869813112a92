"""The loop from scans to tracks: what enters, what is gated, how states follow each other, what is kept of them."""
