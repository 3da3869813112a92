"""Recordings in tables with named columns: CSV and Parquet files, data frames, records."""
