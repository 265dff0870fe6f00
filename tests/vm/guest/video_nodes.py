# SPDX-License-Identifier: Apache-2.0
"""Requests to the kernel's video nodes, as its headers have them (linux/videodev2.h, linux/uvcvideo.h)."""

import ctypes
import fcntl
import mmap
import os
import select
import struct

CAPTURE = 1
META_CAPTURE = 13

VIDIOC_ENUM_FMT = 0xC0405602
VIDIOC_S_FMT = 0xC0D05605
VIDIOC_REQBUFS = 0xC0145608
VIDIOC_QUERYBUF = 0xC0585609
VIDIOC_QBUF = 0xC058560F
VIDIOC_DQBUF = 0xC0585611
VIDIOC_STREAMON = 0x40045612
VIDIOC_S_CTRL = 0xC008561C
VIDIOC_QUERYCTRL = 0xC0445624
VIDIOC_ENUM_FRAMESIZES = 0xC02C564A
VIDIOC_ENUM_FRAMEINTERVALS = 0xC034564B
UVCIOC_CTRL_QUERY = 0xC0107521

# of a buffer of a metadata node: the kernel's time and frame number, then the payload's header of 12 bytes
METADATA_HEAD_BYTES = 10 + 12

SET_CUR, GET_CUR, GET_MIN, GET_MAX, GET_LEN = 0x01, 0x81, 0x82, 0x83, 0x85


def timing_of(buffer):
    """The ten numbers of RealSense's timing block, the first behind the head of a buffer of format D4XX."""
    block = buffer[METADATA_HEAD_BYTES:METADATA_HEAD_BYTES + 40]
    if len(block) < 40:
        raise ValueError(f"{len(block)} of 40 bytes of a timing block: {buffer.hex()}")
    return struct.unpack("<10I", block)


class Node:
    def __init__(self, path):
        self.file = os.open(path, os.O_RDWR)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self.file)

    def _items(self, request, size, *head):
        """What an enumerating request returns for index 0, 1, ... until the kernel refuses."""
        items = []
        while True:
            argument = bytearray(struct.pack(f"<{1 + len(head)}I", len(items), *head).ljust(size, b"\0"))
            try:
                fcntl.ioctl(self.file, request, argument)
            except OSError:
                return items
            items.append(bytes(argument))

    def formats(self, kind=CAPTURE):
        """The fourcc codes."""
        return [item[44:48].decode("latin-1") for item in self._items(VIDIOC_ENUM_FMT, 64, kind)]

    def sizes(self, fourcc):
        code, = struct.unpack("<I", fourcc.encode())
        return [struct.unpack_from("<II", item, 12) for item in self._items(VIDIOC_ENUM_FRAMESIZES, 44, code)]

    def rates(self, fourcc, width, height):
        code, = struct.unpack("<I", fourcc.encode())
        items = self._items(VIDIOC_ENUM_FRAMEINTERVALS, 52, code, width, height)
        intervals = [struct.unpack_from("<II", item, 20) for item in items]
        return [round(denominator / numerator) for numerator, denominator in intervals]

    def controls(self):
        """The node's controls: name and id."""
        found, last = {}, 0
        while True:
            argument = bytearray(struct.pack("<I", last | 0x80000000).ljust(68, b"\0"))  # the next one
            try:
                fcntl.ioctl(self.file, VIDIOC_QUERYCTRL, argument)
            except OSError:
                return found
            last, = struct.unpack_from("<I", argument)
            found[argument[8:40].split(b"\0")[0].decode()] = last

    def set_control(self, name, value=1):
        """Sets a control, or presses it where it is a button."""
        fcntl.ioctl(self.file, VIDIOC_S_CTRL, struct.pack("<Ii", self.controls()[name], value))

    def choose_metadata(self, fourcc):
        """Sets the format of a metadata node; the kernel refuses once the frames' node has buffers."""
        code, = struct.unpack("<I", fourcc.encode())
        fcntl.ioctl(self.file, VIDIOC_S_FMT, bytearray(struct.pack("<IIII", META_CAPTURE, 0, code, 0).ljust(208, b"\0")))

    def metadata(self, count):
        """Buffers of a metadata node while its camera streams.

        A buffer that the kernel takes in the middle of a frame comes back empty: the header, which it copies, stood at
        the frame's beginning. Such ones are left out.
        """
        asked = bytearray(struct.pack("<5I", 4, META_CAPTURE, 1, 0, 0))
        fcntl.ioctl(self.file, VIDIOC_REQBUFS, asked)
        shared = []
        for index in range(struct.unpack_from("<I", asked)[0]):
            buffer = bytearray(88)
            struct.pack_into("<II", buffer, 0, index, META_CAPTURE)
            struct.pack_into("<I", buffer, 60, 1)
            fcntl.ioctl(self.file, VIDIOC_QUERYBUF, buffer)
            offset, length = struct.unpack_from("<Q", buffer, 64)[0], struct.unpack_from("<I", buffer, 72)[0]
            shared.append(mmap.mmap(self.file, length, mmap.MAP_SHARED, mmap.PROT_READ, offset=offset))
            fcntl.ioctl(self.file, VIDIOC_QBUF, buffer)
        fcntl.ioctl(self.file, VIDIOC_STREAMON, struct.pack("<I", META_CAPTURE))
        found = []
        while len(found) < count and select.select([self.file], [], [], 30)[0]:
            buffer = bytearray(88)
            struct.pack_into("<II", buffer, 0, 0, META_CAPTURE)
            struct.pack_into("<I", buffer, 60, 1)
            fcntl.ioctl(self.file, VIDIOC_DQBUF, buffer)
            index, _, used = struct.unpack_from("<3I", buffer)
            if used:
                found.append(shared[index][:used])
            fcntl.ioctl(self.file, VIDIOC_QBUF, buffer)
        for memory in shared:
            memory.close()
        return found

    def unit(self, selector, query, value):
        """A request to control `selector` of extension unit 3; returns its bytes."""
        data = (ctypes.c_uint8 * len(value)).from_buffer_copy(value)
        argument = struct.pack("<BBBxHxxQ", 3, selector, query, len(value), ctypes.addressof(data))
        fcntl.ioctl(self.file, UVCIOC_CTRL_QUERY, argument)
        return bytes(data)

    def monitor(self, opcode, *parameters, data=b""):
        """A command of RealSense's hardware monitor; returns the echoed opcode, or the error, and the data."""
        words = (list(parameters) + [0] * 4)[:4]
        request = struct.pack("<HHI4I", 20 + len(data), 0xCDAB, opcode, *words) + data
        self.unit(1, SET_CUR, request.ljust(1024, b"\0"))
        reply = self.unit(1, GET_CUR, bytes(1024))
        echo, = struct.unpack_from("<i", reply)
        length, = struct.unpack_from("<I", reply, 1020)
        return echo, reply[4:4 + length]

    def orbbec(self, opcode, payload, selector=2, reply_selector=None):
        """A command of Orbbec's protocol; returns the error and the data of the response."""
        sizes = {1: 512, 2: 64, 3: 1024}
        request = struct.pack("<4H", 0x4D47, len(payload) // 2, opcode, 77) + payload
        self.unit(selector, SET_CUR, request.ljust(sizes[selector], b"\0"))
        answering = reply_selector or selector
        reply = self.unit(answering, GET_CUR, bytes(sizes[answering]))
        magic, half_words, echo, number, error = struct.unpack_from("<5H", reply)
        if (magic, echo, number) != (0x4252, opcode, 77):
            raise ValueError(f"a response with {magic:x} {echo} {number}")
        return error, reply[10:8 + 2 * half_words]
