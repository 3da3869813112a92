"""Process and measurement noise, detection, clutter and transitions from a recording's detections, without truth."""
