"""Serial numbers that are alike."""

from hypothesis import example, given
from hypothesis import strategies as st

from accelcal.serials import serials_alike

NAMES = st.lists(st.text("aA bß-\u2010\0\t", max_size=4), unique=True)


def spelled(name: str) -> str:
    return "".join(name.replace("\u2010", "-").casefold().split())


@given(NAMES)
@example([])
@example(["a", "A"])
@example(["a\0", "A\0", "b"])
@example(["a b", "\tAB", "a-b", "a\u2010b"])
def test_serials_are_alike_by_what_is_left_of_each(names):
    alike = serials_alike(names)
    assert all(len(own) > 1 and len(set(map(spelled, own))) == 1 for own in alike)
    left = [own[0] for own in alike] + [n for n in names if not any(n in own for own in alike)]
    assert len({spelled(name) for name in left}) == len(left) == len(set(map(spelled, names)))
