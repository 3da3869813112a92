"""Bridges to other libraries: their objects as Vedette's and back. Each needs its library, and is imported by its name.

- `vedette_adapters.stonesoup`: detections, readers, ground truth and tracks of Stone Soup.
- `vedette_adapters.stonesoup_models`: its transition and measurement models as motion models and sensors.
- `vedette_adapters.filterpy`: FilterPy's matrices as a config; its filters as estimators.
- `vedette_adapters.xarray`: tracks as a data set of xarray, and data sets as tables to be tracked.

pandas needs no bridge: `vedette.track` takes a data frame, and `Result.to_dataframe` gives some.
"""
