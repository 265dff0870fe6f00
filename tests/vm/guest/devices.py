"""The emulated devices that checks plug in. A new kind of device is one more class here."""

import os
import socket
import subprocess

from lab import LAB, Failure, expect, must, read, wait_for, write

RECORDING = LAB + "/recording"


class Kinect:
    """A Kinect v1 on the USB level: our own program behind vhci_hcd, driven by libfreenect over libusb and usbfs."""

    def __init__(self, serial="A00000000000001A", name="kinect", options=()):
        must("modprobe", "vhci-hcd")
        self.control = f"/run/{name}.control"
        self.log = open(f"{LAB}/{name}.log", "a")
        self.process = subprocess.Popen(
            [LAB + "/bin/emulated-kinect", "--recording", RECORDING, "--serial", serial, "--control", self.control,
             *options], stdout=self.log, stderr=self.log)
        wait_for("the emulated Kinect listens", lambda: os.path.exists(self.control) or self._ended())

    def _ended(self):
        if self.process.poll() is not None:
            raise Failure(f"emulated-kinect ended with {self.process.returncode}: " + read(self.log.name)[-400:])
        return False

    def tell(self, command):
        """One command line; returns what the emulator answered."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
            connection.settimeout(10)
            connection.connect(self.control)
            connection.sendall(command.encode() + b"\n")
            answer = connection.makefile().readline().strip()
        expect(not answer.startswith("error"), f"emulated-kinect: {answer}")
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
