// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/v4l2/video_devices.h"
#include "drivers/camera/v4l2/camera_report.h"

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"
#include "tests/support/video/made_up_sysfs.h"

namespace hapticd::drivers {
namespace {

class VideoDevices : public testing::Test {
 protected:
  void SetUp() override {
    test::addNode(folder_.path(), {.name = "video10", .serial = "222", .link = "usb-b"});
    test::addNode(folder_.path(), {.name = "video2", .serial = "111", .link = "usb-a"});
  }

  test::TemporaryFolder folder_;
  config::CameraSettings settings_;
};

TEST_F(VideoDevices, AreListedInTheOrderOfTheirNumbers) {
  const auto devices = videoDevices(folder_.path());
  ASSERT_EQ(devices.size(), 2U);
  EXPECT_EQ(devices[0].node, "/dev/video2");
  EXPECT_EQ(devices[0].name, "Depth Camera");
  EXPECT_EQ(devices[0].vendor, 0x8086);
  EXPECT_EQ(devices[0].product, 0x0b07);
  EXPECT_EQ(devices[0].serial, "111");
  EXPECT_EQ(devices[0].usb_interface, "1-111:1.0");
  EXPECT_EQ(devices[0].links, std::vector<std::string>{"usb-a"});
  EXPECT_EQ(devices[1].node, "/dev/video10");
}

TEST_F(VideoDevices, AreChosenByLinkPathOrSerialNumber) {
  const auto devices = videoDevices(folder_.path());
  for (const std::string name : {"usb-b", "/dev/v4l/by-id/usb-b", "/dev/video10"}) {
    settings_.of<V4l2Settings>().device = name;
    const auto candidates = candidatesOf(settings_, devices);
    ASSERT_TRUE(candidates && candidates->size() == 1) << name;
    EXPECT_EQ(candidates->front().serial, "222") << name;
  }
  settings_.of<V4l2Settings>().device.clear();
  settings_.serial = "111";
  const auto candidates = candidatesOf(settings_, devices);
  ASSERT_TRUE(candidates && candidates->size() == 1);
  EXPECT_EQ(candidates->front().node, "/dev/video2");
}

TEST_F(VideoDevices, AnErrorNamesWhatWasFound) {
  const auto devices = videoDevices(folder_.path());
  settings_.serial = "333";
  EXPECT_NE(candidatesOf(settings_, devices).error().text().find("found: 111, 222"), std::string::npos);
  settings_.serial.clear();
  settings_.of<V4l2Settings>().device = "usb-c";
  EXPECT_NE(candidatesOf(settings_, devices).error().text().find("no device usb-c"), std::string::npos);
  EXPECT_FALSE(candidatesOf({}, videoDevices(folder_.path() / "nothing")));
}

}  // namespace
}  // namespace hapticd::drivers
