import vedette_road as road
from hypothesis import strategies as st
from vedette_road.entrances import Entrance

from vedette.testing import conformance

SPOT = st.sampled_from([(-300.0, 0.0), (0.0, 400.0), (500.0, 100.0)])
PLACE = st.fixed_dictionaries({axis: st.tuples(st.floats(-200.0, 200.0), st.just(50.0)) for axis in ("x", "y", "vx", "vy")})
PLACES = st.tuples(st.builds(Entrance, PLACE), st.builds(Entrance, PLACE))

TestClothoid = conformance(road.Clothoid)
TestTimeDifference = conformance(road.TimeDifference, first=SPOT, second=SPOT)
TestCheapJPDA = conformance(road.CheapJPDA)
TestInARow = conformance(road.InARow)
TestEntrances = conformance(road.Entrances, places=PLACES)
TestSecondOrder = conformance(road.SecondOrder)
