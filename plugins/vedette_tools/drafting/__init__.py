"""What Vedette writes for a newcomer: a config for a table of detections, a package for a plugin."""

from vedette_tools.drafting.config import draft_config
from vedette_tools.drafting.package import distribution_name, draft_package
from vedette_tools.drafting.run import track

__all__ = ["distribution_name", "draft_config", "draft_package", "track"]
