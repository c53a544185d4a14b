"""Reports are thinned out."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from service.throttle import Throttle

TIMES = st.lists(st.floats(0, 10), min_size=1, max_size=50).map(sorted)


@given(TIMES)
def test_values_pass_at_least_an_interval_apart(times: list[float]) -> None:
    throttle = Throttle[float](0.5)
    passed = [time for time in times if throttle.offer(time, time) is not None]
    assert all(later - earlier >= 0.5 for earlier, later in pairwise(passed))
    assert passed[0] == times[0]


@given(TIMES)
def test_last_value_is_never_lost(times: list[float]) -> None:
    throttle = Throttle[int](0.5)
    passed = [throttle.offer(index, time) for index, time in enumerate(times)]
    last = throttle.rest()
    assert (passed[-1] if last is None else last) == len(times) - 1
    assert throttle.rest() is None
