"""All right components by outsiders."""

from foreign import (
    associator_choice,
    associator_joint,
    birth_returns,
    estimator_ensemble,
    estimator_gains,
    estimator_points,
    lifecycle_counts,
    motion_linear,
    motion_split,
    motion_vehicles,
    motion_wrapped,
    preprocessor_clusters,
    sensor_active,
    sensor_angles,
    sensor_heights,
    sensor_passive,
)

COMPONENTS = (
    *motion_linear.COMPONENTS,
    *motion_split.COMPONENTS,
    *motion_vehicles.COMPONENTS,
    *motion_wrapped.COMPONENTS,
    *sensor_active.COMPONENTS,
    *sensor_angles.COMPONENTS,
    *sensor_heights.COMPONENTS,
    *sensor_passive.COMPONENTS,
    *associator_choice.COMPONENTS,
    *associator_joint.COMPONENTS,
    *estimator_ensemble.COMPONENTS,
    *estimator_gains.COMPONENTS,
    *estimator_points.COMPONENTS,
    *birth_returns.COMPONENTS,
    *lifecycle_counts.COMPONENTS,
    *preprocessor_clusters.COMPONENTS,
)
