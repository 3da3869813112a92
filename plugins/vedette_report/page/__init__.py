"""The page of a run: one HTML file that needs no network and no other file."""

from vedette_report.page.build import target_of as target_of
from vedette_report.page.build import write_page as write_page
from vedette_report.page.skeleton import page as page
