// SPDX-License-Identifier: Apache-2.0
// The check of depth cameras that the kernel drives, on synthetic files of /sys, /proc, /etc and /dev.
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <algorithm>

#include "doctor_fixture.h"
#include "tests/support/video/made_up_sysfs.h"

namespace hapticd::tools {
namespace {

class DoctorsCamera : public DoctorOnFiles {
 protected:
  DoctorsCamera() {
    test::fillWithAGoodBox(files);
    test::addNode(files.root(), {.serial = "77"});
    files.set(kUsb + "idVendor", "8086");
    files.set(kUsb + "idProduct", "0b07");
    files.set(kUsb + "speed", "5000");
    files.makeFolder("sys/module/uvcvideo");
    files.set("dev/video0", "");
    files.setMode("dev/video0", 0660);
    box.configuration.settings.camera.driver = config::CameraDriver::v4l2;
    box.depth_probe = [](const drivers::VideoDevice&) -> config::Result<std::uint32_t> {
      return V4L2_PIX_FMT_Z16;
    };
  }

  Finding named(const std::string& name) const {
    const Findings findings = checkCameras(box);
    const auto found = std::ranges::find(findings, name, &Finding::name);
    return found == findings.end() ? Finding{} : *found;
  }

  const std::string kUsb = "sys/bus/usb/devices/1-77/";
};

TEST_F(DoctorsCamera, IsFoundWithItsNodeAndFormat) {
  const Findings findings = checkCameras(box);
  EXPECT_EQ(std::ranges::count(findings, Verdict::ok, &Finding::verdict), std::ssize(findings))
      << textOf(findings);
  EXPECT_TRUE(says(named("depth camera"), Verdict::ok,
                   "Intel RealSense D435 at /dev/video0, Z16, serial number 77", ""));
  EXPECT_TRUE(says(named("uvcvideo"), Verdict::ok, "loaded", ""));
}

TEST_F(DoctorsCamera, TakesNoMoreThanItsLinkCarries) {
  // 848 x 480 pixels of 2 bytes
  EXPECT_TRUE(says(named("depth camera bandwidth"), Verdict::ok,
                   "848 x 480 at 30 Hz takes 24.4 MB/s of a link with 5000 Mbit/s", ""));
  files.set(kUsb + "speed", "480");
  EXPECT_EQ(named("depth camera bandwidth").verdict, Verdict::ok);
  box.configuration.settings.camera.v4l2.rate_hz = 90;
  EXPECT_TRUE(says(named("depth camera bandwidth"), Verdict::fail,
                   "73.3 MB/s of a link with 480 Mbit/s: more than it carries", "USB 3"));
  files.remove(kUsb + "speed");
  EXPECT_TRUE(says(named("depth camera bandwidth"), Verdict::ok, "unknown", ""));
}

TEST_F(DoctorsCamera, MustBeForTheGroupOfTheDaemon) {
  EXPECT_TRUE(says(named("depth camera access"), Verdict::ok, "for the group hapticd only", ""));
  files.setMode("dev/video0", 0666);
  EXPECT_TRUE(
      says(named("depth camera access"), Verdict::warn, "/dev/video0 has mode 0666", "udevadm trigger"));
}

TEST_F(DoctorsCamera, MayBeAbsent) {
  files.remove("sys/class/video4linux");
  files.remove(kUsb);
  EXPECT_TRUE(
      says(named("depth camera"), Verdict::warn, "there is no video device", "hapticctl camera list"));
}

TEST_F(DoctorsCamera, NeedsTheKernelsModule) {
  files.remove("sys/module/uvcvideo");
  EXPECT_TRUE(says(named("uvcvideo"), Verdict::warn, "not loaded", "modprobe uvcvideo"));
}

TEST_F(DoctorsCamera, IsNotExaminedWithAnotherDriver) {
  box.configuration.settings.camera.driver = config::CameraDriver::freenect;
  EXPECT_EQ(checkCameras(box).size(), 1U);
  EXPECT_TRUE(says(named("depth camera"), Verdict::ok, "camera.driver is freenect", ""));
}

TEST_F(DoctorsCamera, OfAVendorsSoftwareIsNamedWithTheReason) {
  files.set(kUsb + "idVendor", "045e");
  files.set(kUsb + "idProduct", "097c");
  files.remove("sys/class/video4linux");
  EXPECT_TRUE(says(named("depth camera"), Verdict::warn,
                   "Azure Kinect at 045e:097c at 1-77 cannot be used: it delivers infrared images", ""));
}

TEST_F(DoctorsCamera, AKinectIsNotMissedWithIt) {
  files.remove("sys/bus/usb/devices/1-1.1");
  const Findings findings = checkKinect(box);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_TRUE(says(findings.front(), Verdict::ok, "none on USB, and camera.driver is v4l2", ""));
}

}  // namespace
}  // namespace hapticd::tools
