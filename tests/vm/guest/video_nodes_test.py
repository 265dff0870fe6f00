# SPDX-License-Identifier: Apache-2.0
"""video_nodes without a camera: the kernel's answers are given."""

import struct
import unittest
from unittest import mock

import video_nodes

# As uvcvideo copies it: time, frame number, header of 12 bytes with flags, times and the bus's counter, then the block.
HEAD = struct.pack("<QH", 123456789, 7) + struct.pack("<BBIIH", 152, 0x8E, 1000, 9000, 42)
TIMING = struct.pack("<10I", 0x80000001, 40, 1, 0x3F, 5, 4166, 16666, 8333, 33333, 25000)


class MetadataNode:
    """The kernel's side of a node with buffers that come back with these contents, in turn."""

    def __init__(self, contents):
        self.contents = list(contents)
        self.memory = [bytearray(1024) for _ in range(4)]
        self.next = 0

    def ioctl(self, _file, request, argument):
        if request == video_nodes.VIDIOC_QUERYBUF:
            struct.pack_into("<Q", argument, 64, struct.unpack_from("<I", argument)[0])  # the offset says which one
            struct.pack_into("<I", argument, 72, 1024)
        elif request == video_nodes.VIDIOC_DQBUF:
            content, index = self.contents[self.next], self.next % 4
            self.memory[index][:len(content)] = content
            struct.pack_into("<3I", argument, 0, index, video_nodes.META_CAPTURE, len(content))
            self.next += 1

    def mmap(self, _file, _length, *_, offset):
        shared = mock.MagicMock()
        shared.__getitem__.side_effect = lambda part: bytes(self.memory[offset][part])
        return shared

    def read(self, count):
        with mock.patch("os.open", return_value=99), mock.patch("os.close"), \
             mock.patch("fcntl.ioctl", self.ioctl), mock.patch("mmap.mmap", self.mmap), \
             mock.patch("select.select", lambda *_: ([99], [], [])), video_nodes.Node("/dev/video1") as node:
            return node.metadata(count)


class Metadata(unittest.TestCase):
    def test_a_buffer_that_was_taken_in_the_middle_of_a_frame_is_left_out(self):
        found = MetadataNode([b"", HEAD + TIMING, HEAD + TIMING]).read(2)
        self.assertEqual(found, [HEAD + TIMING] * 2)

    def test_the_timing_block_stands_behind_the_head(self):
        self.assertEqual(video_nodes.timing_of(HEAD + TIMING + bytes(100))[4:9], (5, 4166, 16666, 8333, 33333))

    def test_a_block_that_is_cut_is_named_with_its_bytes(self):
        with self.assertRaisesRegex(ValueError, "18 of 40 bytes"):
            video_nodes.timing_of((HEAD + TIMING)[:40])


if __name__ == "__main__":
    unittest.main()
