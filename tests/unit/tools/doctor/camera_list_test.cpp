// SPDX-License-Identifier: Apache-2.0
// `hapticctl camera list` on synthetic files of /sys and /dev.
#include "tools/hapticctl/doctor/cameras.h"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <nlohmann/json.hpp>

#include "drivers/camera/v4l2/camera_report.h"
#include "made_up_machine.h"
#include "tests/support/program.h"
#include "tests/support/video/made_up_sysfs.h"

namespace hapticd::tools {
namespace {

class CameraListing : public testing::Test {
 protected:
  CameraListing() { settings.driver = "v4l2"; }

  CameraList list() const { return listCameras(Machine(files.root()), settings, probe); }
  ConnectedCamera only() const {
    const CameraList found = list();
    EXPECT_EQ(found.cameras.size(), 1U) << textOf(found);
    return found.cameras.empty() ? ConnectedCamera{} : found.cameras.front();
  }

  test::MadeUpMachine files;
  config::CameraSettings settings;
  std::string depth_node = "/dev/video0";
  DepthProbe probe = [this](const drivers::VideoDevice& video) -> base::Result<std::uint32_t> {
    return video.node == depth_node ? V4L2_PIX_FMT_Z16 : 0;
  };
};

TEST_F(CameraListing, ShowsOneLineForAllNodesOfADevice) {
  depth_node = "/dev/video2";
  for (const char* name : {"video0", "video1", "video2"}) {
    test::addNode(files.root(), {.name = name, .link = std::string("link-") + name});
  }
  EXPECT_EQ(textOf(list()),
            "used      /dev/video2: Intel RealSense D435, serial number 012345678901, depth in Z16\n"
            "hapticd takes its depth from /dev/video2\n");
}

TEST_F(CameraListing, NamesTheSettingThatWouldUseAnotherCamera) {
  test::addNode(files.root(), {});
  settings.driver = "synthetic";
  EXPECT_EQ(only().suitability, Suitability::usable);
  EXPECT_EQ(only().note, "set camera.driver to v4l2");
  EXPECT_EQ(list().source, "a computed scene");
  settings.driver = "v4l2";
  settings.serial = "77";
  EXPECT_EQ(only().note, "set camera.serial to 012345678901");
  EXPECT_EQ(list().source, "");
  EXPECT_NE(list().problem.find("no camera has the serial number 77"), std::string::npos) << list().problem;
}

TEST_F(CameraListing, SaysThatACameraDeliversNoDepth) {
  depth_node.clear();
  test::addNode(files.root(), {.vendor = "046d", .product = "0825"});
  EXPECT_EQ(only().suitability, Suitability::unusable);
  EXPECT_EQ(only().name, "Depth Camera");  // as it calls itself
  EXPECT_EQ(only().note, "it delivers no depth in the formats Z16 and Y16");
  EXPECT_EQ(list().problem, "none of the video devices that the configuration allows delivers depth");
}

TEST_F(CameraListing, ShowsWhyADeviceCannotBeOpened) {
  test::addNode(files.root(), {});
  probe = [](const drivers::VideoDevice&) -> base::Result<std::uint32_t> {
    return std::unexpected(base::Error{"v4l2", "the camera cannot be opened: Permission denied", ""});
  };
  EXPECT_EQ(only().suitability, Suitability::unusable);
  EXPECT_EQ(only().note, "v4l2: the camera cannot be opened: Permission denied");
}

TEST_F(CameraListing, NamesCamerasThatNeedTheirVendorsSoftware) {
  struct Case {
    std::string vendor, product, name, reason;
  };
  for (const auto& [vendor, product, name, reason] :
       std::vector<Case>{{"045e", "097c", "Azure Kinect", "computes the depth"},
                         {"2bc5", "066b", "Orbbec Femto Bolt", "computes the depth"},
                         {"03e7", "2485", "Luxonis OAK-D", "not a video device"},
                         {"2b03", "f780", "Stereolabs ZED", "computes the depth"},
                         {"045e", "02c4", "Kinect v2", "libfreenect2"}}) {
    files.addUsbDevice("2-1", vendor, product);
    EXPECT_EQ(only().suitability, Suitability::unusable) << name;
    EXPECT_EQ(only().name, name);
    EXPECT_EQ(only().place, vendor + ":" + product + " at 2-1");
    EXPECT_NE(only().note.find(reason), std::string::npos) << only().note;
  }
}

TEST_F(CameraListing, AVideoDeviceOfAVendorsSoftwareIsNamedToo) {
  depth_node.clear();
  test::addNode(files.root(), {.vendor = "2b03", .product = "f582"});
  EXPECT_EQ(only().name, "Stereolabs ZED");
  EXPECT_NE(only().note.find("two colour images"), std::string::npos) << only().note;
}

TEST_F(CameraListing, AsksForTheKernelsModuleWhereADepthCameraHasNoNode) {
  files.addUsbDevice("2-1", "8086", "0b5b");
  EXPECT_EQ(only().name, "Intel RealSense D405");
  EXPECT_NE(only().note.find("modprobe uvcvideo"), std::string::npos) << only().note;
}

TEST_F(CameraListing, SaysThatTheLoadedModuleRefusesACamera) {
  files.makeFolder("sys/module/uvcvideo");
  files.addUsbDevice("2-1", "8086", "0b5b");
  EXPECT_NE(only().note.find("no video in its description"), std::string::npos) << only().note;
  EXPECT_EQ(only().note.find("modprobe"), std::string::npos) << only().note;
}

TEST_F(CameraListing, AKinectIsForTheDriverFreenect) {
  files.addUsbDevice("1-1.1", "045e", "02ae");
  // the kernel's driver, which libfreenect detaches
  test::addNode(files.root(), {.vendor = "045e", .product = "02ae"});
  EXPECT_EQ(only().note, "set camera.driver to freenect");
  settings.driver = "freenect";
  EXPECT_EQ(only().suitability, Suitability::used);
  EXPECT_EQ(list().source, "045e:02ae at 1-1.1");
  settings.serial = "A1";
  EXPECT_EQ(only().note, "camera.serial chooses one of several");
  EXPECT_EQ(list().source, "the Kinect v1 with the serial number A1");
}

TEST_F(CameraListing, ADeviceOfAnotherMachineIsJudgedByItsIds) {
  test::addNode(files.root(), {});
  probe = {};
  EXPECT_EQ(only().suitability, Suitability::used);
  EXPECT_EQ(list().source, "/dev/video0");
}

TEST_F(CameraListing, OtherDevicesOnUsbAreNoCameras) {
  files.addUsbDevice("2-1", "046d", "c52b");
  EXPECT_EQ(
      textOf(list()),
      "no camera is connected\nhapticd finds no camera: v4l2: there is no video device (connect the camera "
      "to a USB 3 port; journalctl -k shows what the kernel finds)\n");
}

TEST_F(CameraListing, NoNodeOfTheCameraThatARunningDaemonHoldsIsOpened) {
  for (const char* name : {"video0", "video1", "video2"}) {
    test::addNode(files.root(), {.name = name, .link = std::string("link-") + name});
  }
  settings.of<drivers::V4l2Settings>().device = "/dev/video0";  // changed since the daemon was started
  std::vector<std::string> opened;
  const DepthProbe noting = [&](const drivers::VideoDevice& video) -> base::Result<std::uint32_t> {
    opened.push_back(video.node);
    return 0;
  };
  const CameraList found = listCameras(Machine(files.root()), settings, noting, {"/dev/video2", "Z16"});
  EXPECT_TRUE(opened.empty()) << opened.front();
  EXPECT_EQ(found.source, "/dev/video2");
  ASSERT_EQ(found.cameras.size(), 1U);
  EXPECT_EQ(found.cameras.front().suitability, Suitability::used);
  EXPECT_EQ(found.cameras.front().format, "Z16");
}

TEST_F(CameraListing, SaysWhereTheConfigurationComesFromAndWhatTheDaemonsCameraDoes) {
  CameraList shown;
  shown.source = "a computed scene";
  shown.state = "streaming";
  shown.configuration = "as the running hapticd uses it (/run/socket)";
  EXPECT_EQ(textOf(shown),
            "no camera is connected\nhapticd takes its depth from a computed scene: streaming\n"
            "configuration: as the running hapticd uses it (/run/socket)\n");
}

TEST_F(CameraListing, NoAdviceOfTheListNamesTheList) {
  EXPECT_EQ(textOf(list()).find("camera list"), std::string::npos) << textOf(list());
}

TEST_F(CameraListing, TheCommandReadsTheConfigurationBelowItsRoot) {
  test::addNode(files.root(), {});
  files.set("etc/hapticd/hapticd.yaml", "camera: {driver: v4l2}");
  const auto finished =
      test::runToEnd({HAPTICCTL_PROGRAM, "--json", "camera", "list", "--root", files.root()});
  EXPECT_EQ(finished.ending, test::exitedWith(0)) << finished.errors;
  const nlohmann::json shown = nlohmann::json::parse(finished.output);
  EXPECT_EQ(shown["source"], "/dev/video0");
  EXPECT_EQ(shown["cameras"][0]["suitability"], "used");
  files.set("etc/hapticd/hapticd.yaml", "camera: {driver: video}");
  EXPECT_EQ(test::runToEnd({HAPTICCTL_PROGRAM, "camera", "list", "--root", files.root()}).ending,
            test::exitedWith(1));
}

TEST(CameraTestCommand, ShowsWhyTheCameraCannotBeUsed) {
  const auto finished =
      test::runToEnd({HAPTICCTL_PROGRAM, "camera", "test", "--device", "/dev/no-such-video"});
  EXPECT_EQ(finished.ending, test::exitedWith(1));
  EXPECT_EQ(finished.output, "");
  EXPECT_NE(finished.errors.find("the camera delivers no frames: v4l2: there is no "), std::string::npos)
      << finished.errors;
}

}  // namespace
}  // namespace hapticd::tools
