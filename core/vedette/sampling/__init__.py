"""Drawing trajectories from motion models, and detections of them from sensors."""
