from vedette_clothoid import Clothoid

from vedette.testing import conformance

TestClothoid = conformance(Clothoid)
