# SPDX-License-Identifier: Apache-2.0
"""The emulated devices that checks plug in. A new kind of device is one more class here."""

import json
import os
import socket
import subprocess

from lab import LAB, Failure, expect, must, read, wait_for, write

RECORDING = LAB + "/recording"


class Emulator:
    """One of our own programs that plays a device and takes commands on a socket."""

    def __init__(self, program, name, *options):
        self.program = program
        self.control = f"/run/{name}.control"
        self.log = open(f"{LAB}/{name}.log", "a")
        self.process = subprocess.Popen([f"{LAB}/bin/{program}", "--control", self.control, *options], stdout=self.log,
                                        stderr=self.log)
        wait_for(f"{program} listens", lambda: os.path.exists(self.control) or self._ended())

    def _ended(self):
        if self.process.poll() is not None:
            raise Failure(f"{self.program} ended with {self.process.returncode}: " + read(self.log.name)[-400:])
        return False

    def tell(self, command):
        """One command line; returns what the emulator answered."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
            connection.settimeout(10)
            connection.connect(self.control)
            connection.sendall(command.encode() + b"\n")
            answer = connection.makefile().readline().strip()
        expect(not answer.startswith("error"), f"{self.program}: {answer}")
        return answer

    def end(self):
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(10)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        self.log.close()


class Kinect(Emulator):
    """A Kinect v1 on the USB level: our own program behind vhci_hcd, driven by libfreenect over libusb and usbfs."""

    def __init__(self, serial="A00000000000001A", name="kinect", options=()):
        must("modprobe", "vhci-hcd")
        super().__init__("emulated-kinect", name, "--recording", RECORDING, "--serial", serial, *options)


class DepthCamera(Emulator):
    """A depth camera of the USB video class: our own program behind vhci_hcd, driven by the kernel's uvcvideo."""

    def __init__(self, serial="814512070123", name="depth-camera", options=()):
        for module in ("vhci-hcd", "uvcvideo"):
            must("modprobe", module)
        self.serial = serial
        super().__init__("emulated-depth-camera", name, "--serial", serial, *options)

    def _nodes(self):
        found = {}
        for node in os.listdir("/sys/class/video4linux"):
            folder = "/sys/class/video4linux/" + node
            try:
                if read(folder + "/device/../serial").strip() == self.serial:
                    found[int(read(folder + "/index"))] = "/dev/" + node
            except OSError:  # it vanishes while we look
                continue
        return found

    def nodes(self):
        """The camera's nodes: that of the frames, and that of the metadata."""
        found = self._nodes()
        expect(len(found) == 2 and all(os.path.exists(path) for path in found.values()), f"nodes: {found}")
        return [found[index] for index in sorted(found)]

    def node(self):
        return wait_for("the kernel makes nodes of the camera", self.nodes)[0]

    def is_absent(self):
        return not self._nodes()

    def replug(self, *commands):
        """Unplugs it, gives it commands, plugs it in again."""
        self.tell("unplug")
        wait_for("its nodes vanish", self.is_absent)
        for command in commands:
            self.tell(command)
        self.tell("replug")

    def stats(self):
        return json.loads(self.tell("status"))


class HidHandle(Emulator):
    """A controller in a hand, or a SpaceMouse, on the HID level through uhid; driven by hidapi over hidraw."""

    def __init__(self, serial="T1", name="handle", options=()):
        must("modprobe", "uhid")
        super().__init__("emulated-hid-handle", name, "--serial", serial, *options)

    def stats(self):
        return json.loads(self.tell("stats"))


class HidGadget(HidHandle):
    """The controller as a USB device: a gadget with a HID function on the dummy host controller."""

    FOLDER = "/sys/kernel/config/usb_gadget/handle"
    # As drivers/handle/hid/reports.md has it.
    DESCRIPTOR = bytes.fromhex("06ABFF0A0002A101750815 0026FF0095400901810295400902 9102C0")

    def __init__(self, serial="G1"):
        for module in ("dummy_hcd", "libcomposite", "usb_f_hid"):
            must("modprobe", module)
        function = self.FOLDER + "/functions/hid.usb0"
        for folder in ("/strings/0x409", "/configs/c.1", "/functions/hid.usb0"):
            os.makedirs(self.FOLDER + folder)
        for name, value in (("idVendor", "0x1209"), ("idProduct", "0x0001"), ("strings/0x409/serialnumber", serial),
                            ("strings/0x409/product", "hapticd test controller"), ("functions/hid.usb0/protocol", "0"),
                            ("functions/hid.usb0/subclass", "0"), ("functions/hid.usb0/report_length", "64")):
            write(f"{self.FOLDER}/{name}", value)
        with open(function + "/report_desc", "wb") as file:
            file.write(self.DESCRIPTOR)
        os.symlink(function, self.FOLDER + "/configs/c.1/hid.usb0")
        self.plug()
        wait_for("the gadget's node", lambda: os.path.exists("/dev/hidg0"))
        super().__init__(serial, "gadget", ("--gadget", "/dev/hidg0"))

    def plug(self):
        write(self.FOLDER + "/UDC", os.listdir("/sys/class/udc")[0])

    def unplug(self):
        write(self.FOLDER + "/UDC", "\n")

    def end(self):
        super().end()
        self.unplug()
        os.remove(self.FOLDER + "/configs/c.1/hid.usb0")
        for folder in ("/configs/c.1", "/functions/hid.usb0", "/strings/0x409", ""):
            os.rmdir(self.FOLDER + folder)


class GpioChip:
    """A chip of gpio-sim: its lines are driven by the daemon through the real character device and read from sysfs."""

    FOLDER = "/sys/kernel/config/gpio-sim/box"

    def __init__(self, names):
        must("modprobe", "gpio-sim")
        os.makedirs(self.FOLDER + "/bank0", exist_ok=True)
        write(self.FOLDER + "/bank0/num_lines", str(len(names)))
        write(self.FOLDER + "/bank0/label", "box-leds")
        for number, name in enumerate(names):
            os.makedirs(f"{self.FOLDER}/bank0/line{number}", exist_ok=True)
            write(f"{self.FOLDER}/bank0/line{number}/name", name)
        self.names = list(names)
        self.appear()

    def appear(self):
        write(self.FOLDER + "/live", "1")
        device = read(self.FOLDER + "/dev_name").strip()
        self.chip = read(self.FOLDER + "/bank0/chip_name").strip()
        self.lines = f"/sys/devices/platform/{device}/{self.chip}"

    def vanish(self):
        write(self.FOLDER + "/live", "0")

    def value(self, name):
        return int(read(f"{self.lines}/sim_gpio{self.names.index(name)}/value"))

    def remove(self):
        self.vanish()
        for number in range(len(self.names)):
            os.rmdir(f"{self.FOLDER}/bank0/line{number}")
        os.rmdir(self.FOLDER + "/bank0")
        os.rmdir(self.FOLDER)
