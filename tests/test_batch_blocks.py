"""How the files of a batch are divided into blocks, and how a block travels."""

import pickle

import pytest

from accelcal.archive.block import Block
from accelcal.archive.parts import Part
from accelcal.archive.sources import Aside, SourceFile, Sources
from accelcal.archive.through import LAST_FILES, MOST_FILES, blocks_of


def sources(count):
    return Sources([SourceFile(f"{i}.csv", 3000, str(i)) for i in range(count)], Aside())


@pytest.mark.parametrize("count", [1, 26, 201, 4321, 10_000, 12_345])
def test_every_file_is_in_one_block_in_its_order(count):
    blocks = list(blocks_of(sources(count)))
    assert [file for block in blocks for file in block.files] == list(sources(count))
    assert [block.place for block in blocks] == list(range(len(blocks)))


def test_the_last_blocks_of_a_large_archive_are_smaller():
    sizes = [len(block.files) for block in blocks_of(sources(12_300))]
    assert sizes == [MOST_FILES] * 11 + [650, LAST_FILES, 150]


def test_those_of_a_small_archive_are_alike():
    assert [len(block.files) for block in blocks_of(sources(400))] == [50] * 8


@pytest.mark.parametrize("part", [None, Part(10, 20, 5)])
@pytest.mark.parametrize("count", [0, 1, 3])
def test_a_block_arrives_as_it_was_sent(count, part):
    block = Block(tuple(sources(count)), part, place=7)
    arrived = pickle.loads(pickle.dumps(block))
    assert arrived == block
    assert all(type(file) is SourceFile for file in arrived.files)
