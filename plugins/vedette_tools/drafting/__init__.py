"""What Vedette writes for a newcomer: a config for a table of detections, a package for a plugin."""
