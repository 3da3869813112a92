"""Bridges to other libraries: their objects as Vedette's and back. Each needs its library, and is imported by its name.

- `vedette.adapters.stonesoup`: detections, readers, ground truth and tracks of Stone Soup.
- `vedette.adapters.stonesoup_models`: its transition and measurement models as motion models and sensors.
- `vedette.adapters.filterpy`: FilterPy's matrices as a config; its filters as estimators.
- `vedette.adapters.xarray`: tracks as a data set of xarray, and data sets as tables to be tracked.

pandas needs no bridge: `vedette.track` takes a data frame, and `Result.to_dataframe` gives some.
"""
