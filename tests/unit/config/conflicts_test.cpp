// SPDX-License-Identifier: Apache-2.0
// The rules between parameters whose individual values are all in range.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <ostream>
#include <string>
#include <vector>

#include "config/settings/parameter_table.h"
#include "drivers/handle/simulated/simulated_hand.h"
#include "rt/laws/law_table.h"
#include "rt/modelling/scene_builder.h"

namespace hapticd::config {
namespace {

using Texts = std::vector<std::string>;

Settings with(const Texts& changes) {
  Settings settings;
  for (const std::string& change : changes) {
    const base::Result<void> result = setFromText(settings, change);
    EXPECT_TRUE(result) << result.error().text();
  }
  return settings;
}

Texts textsFor(const Texts& changes) {
  Texts texts;
  for (const base::Error& error : checkTogether(with(changes))) texts.push_back(error.text());
  return texts;
}

struct Case {
  std::string name;  ///< of the test
  Texts changes;     ///< of the defaults
  Texts texts = {};  ///< all errors; none: allowed
};

void PrintTo(const Case& one, std::ostream* stream) {
  *stream << fmt::format("{}", one.name);
}

class Conflicts : public testing::TestWithParam<Case> {};

TEST_P(Conflicts, AreExactlyThese) {
  EXPECT_EQ(textsFor(GetParam().changes), GetParam().texts);
}

std::string nameOf(const testing::TestParamInfo<Case>& test) {
  return test.param.name;
}

const std::vector<Case> kForce{
    {"AsManyPointsAtLeastAsAtMost", {"force.min_points=100"}},
    {"MorePointsAtLeastThanAtMost",
     {"force.min_points=101"},
     {"force.min_points: 101 is above force.max_points, 100 (set force.min_points to at most 100 or "
      "force.max_points to at least 101)"}},
    {"SeveralViolatedRules",
     {"camera.near_m=5", "force.min_points=200", "control.status_socket="},
     {"force.min_points: 200 is above force.max_points, 100 (set force.min_points to at most 100 or "
      "force.max_points to at least 200)",
      "camera.near_m: 5 m is not below camera.far_m, 4 m (set camera.near_m below camera.far_m)",
      "control.status_socket: is empty (give the path of the socket)"}},
};
INSTANTIATE_TEST_SUITE_P(Force, Conflicts, testing::ValuesIn(kForce), nameOf);

const std::string kUsualSize = ", or to 0 for the usual size of the camera)";
const std::vector<Case> kCamera{
    {"NearBelowFar", {"camera.near_m=2", "camera.far_m=2.5"}},
    {"NearAtFar",
     {"camera.near_m=2", "camera.far_m=2"},
     {"camera.near_m: 2 m is not below camera.far_m, 2 m (set camera.near_m below camera.far_m)"}},
    // Table I: raw 1052 is 9.991 m, raw 1053 is 10.308 m.
    {"NoRawValueBetweenTheLimits",
     {"camera.near_m=9.995", "camera.far_m=10"},
     {"camera.depth_law: Z = 1 / (-0.003071102 d + 3.330949516) lies between camera.near_m, 9.995 m, and "
      "camera.far_m, 10 m, for no raw value d of 0..2046 (move camera.near_m and camera.far_m further "
      "apart)"}},
    {"DepthLawInFrontOfTheCamera",
     {"camera.depth_law=custom", "camera.depth_a_per_m=-0.0029", "camera.depth_b_per_m=3.15"}},
    {"DepthLawBehindTheCamera",  // 1/Z stays below 0
     {"camera.depth_law=custom", "camera.depth_a_per_m=-0.003", "camera.depth_b_per_m=-1"},
     {"camera.depth_law: Z = 1 / (-0.003 d + -1) lies between camera.near_m, 0.4 m, and camera.far_m, 4 m, "
      "for no "
      "raw value d of 0..2046 (correct camera.depth_a_per_m and camera.depth_b_per_m: about -0.003 and 3.3 "
      "for a "
      "Kinect v1)"}},
    {"DepthLawThatIsNotInUse", {"camera.depth_a_per_m=-0.003", "camera.depth_b_per_m=-1"}},
    {"UsualWidth", {"camera.width_px=0"}},
    {"LeastWidth", {"camera.width_px=160"}},
    {"WidthBelowTheLeast",
     {"camera.width_px=159"},
     {"camera.width_px: 159 px is below 160 px (set camera.width_px to at least 160" + kUsualSize}},
    {"UsualHeight", {"camera.height_px=0"}},
    {"LeastHeight", {"camera.height_px=100"}},
    {"HeightBelowTheLeast",
     {"camera.height_px=1"},
     {"camera.height_px: 1 px is below 100 px (set camera.height_px to at least 100" + kUsualSize}},
    {"RecordedWithARecording", {"camera.driver=recorded", "camera.recording=somewhere"}},
    {"RecordedWithoutARecording",
     {"camera.driver=recorded"},
     {"camera.recording: is empty, and the camera.driver recorded needs it (set camera.recording to the "
      "folder "
      "that holds INDEX.txt or camera.yaml)"}},
};
INSTANTIATE_TEST_SUITE_P(Camera, Conflicts, testing::ValuesIn(kCamera), nameOf);

const std::string kKinectsIntrinsics =
    "camera.intrinsics: configured takes camera.fx_px and camera.fy_px, which are still those of a Kinect v1 "
    "(set camera.fx_px, camera.fy_px, camera.cx_px and camera.cy_px for the chosen size of the frames)";
const std::string kForSize = " pixels (set camera.cx_px and camera.cy_px for the chosen size of the frames)";
const std::string kEndsBeforeNear =
    "camera.unit_um: 16 bits of 1 um end at 0.065535 m, nearer than camera.near_m, 0.4 m (set camera.unit_um "
    "to "
    "100 or 1000, or to 0)";
const std::vector<Case> kDepthCamera{
    {"V4l2", {"camera.driver=v4l2"}},
    {"SyntheticKinect", {"camera.driver=synthetic", "synthetic.camera=kinect"}},
    {"SyntheticStereo", {"camera.driver=synthetic", "synthetic.camera=stereo"}},
    {"SyntheticTimeOfFlight", {"camera.driver=synthetic", "synthetic.camera=time_of_flight"}},
    {"IntrinsicsOfAKinect", {"camera.driver=v4l2", "camera.intrinsics=configured"}, {kKinectsIntrinsics}},
    {"IntrinsicsOfAKinectForSyntheticStereo",
     {"camera.driver=synthetic", "synthetic.camera=stereo", "camera.intrinsics=configured"},
     {kKinectsIntrinsics}},
    {"IntrinsicsAndUnitOfASyntheticKinectAreItsOwn",
     {"camera.driver=synthetic", "camera.intrinsics=configured", "camera.unit_um=1"}},
    {"OwnIntrinsics",
     {"camera.driver=v4l2", "camera.intrinsics=configured", "camera.fx_px=430", "camera.fy_px=430",
      "camera.cx_px=424"}},
    {"OpticalCentreOutsideTheFrame",
     {"camera.driver=v4l2", "camera.intrinsics=configured", "camera.fx_px=430", "camera.cx_px=900"},
     {"camera.cx_px: the optical centre (900, 242.739138) lies outside the frame of 848 x 480" + kForSize}},
    {"OpticalCentreOutsideTheFrameOfSyntheticTimeOfFlight",
     {"camera.driver=synthetic", "synthetic.camera=time_of_flight", "camera.intrinsics=configured",
      "camera.fx_px=430", "camera.cx_px=700"},
     {"camera.cx_px: the optical centre (700, 242.739138) lies outside the frame of 640 x 576" + kForSize}},
    {"UnitThatReachesTheNearLimit", {"camera.driver=v4l2", "camera.unit_um=10"}},
    {"UnitThatEndsBeforeTheNearLimit", {"camera.driver=v4l2", "camera.unit_um=1"}, {kEndsBeforeNear}},
    {"UnitThatEndsBeforeTheNearLimitForSyntheticStereo",
     {"camera.driver=synthetic", "synthetic.camera=stereo", "camera.unit_um=1"},
     {kEndsBeforeNear}},
    // 2044 units of 0.1 mm, the camera's own unit at best, hold 2 * (0.07 m + 0.6 m/s * (1/30 s + 0.02 s)).
    {"ReachThatTheCamerasOwnUnitHolds",
     {"camera.driver=v4l2", "force.law=nearest_springs", "force.radius_m=0.07"}},
    {"ReachThatTheCamerasOwnUnitDoesNotHold",
     {"camera.driver=v4l2", "force.law=nearest_springs", "force.radius_m=0.071"},
     {"camera.unit_um: a scene holds 0.2044 m of depth in units of 100 um, but the law nearest_springs needs "
      "0.206 "
      "m: 0.071 m on each side that it looks at, and what the HIP moves until the next frame (set "
      "camera.unit_um "
      "to at least 101, or lower force.radius_m)"}},
    {"ReachThatTheUnitHolds", {"camera.driver=v4l2", "force.law=nearest_springs", "camera.unit_um=71"}},
    {"ReachThatTheUnitDoesNotHold",
     {"camera.driver=v4l2", "force.law=nearest_springs", "camera.unit_um=70"},
     {"camera.unit_um: a scene holds 0.1431 m of depth in units of 70 um, but the law nearest_springs needs "
      "0.144 "
      "m: 0.04 m on each side that it looks at, and what the HIP moves until the next frame (set "
      "camera.unit_um "
      "to at least 71, or lower force.radius_m)"}},
    {"TheLawSurfaceHasNoPointsThatAUnitCouldLimit",
     {"camera.driver=v4l2", "force.law=surface", "camera.unit_um=10"}},
    // with a large allowed error auto chooses the springs far away
    {"ReachOfALawThatAutoMayChoose",
     {"camera.driver=synthetic", "synthetic.camera=stereo", "camera.unit_um=70", "force.max_error_n=10",
      "force.stiffness_n_per_m=100"},
     {"camera.unit_um: a scene holds 0.1431 m of depth in units of 70 um, but the law nearest_springs, which "
      "auto "
      "may choose, needs 0.144 m: 0.04 m on each side that it looks at, and what the HIP moves until the "
      "next "
      "frame (set camera.unit_um to at least 71, or lower force.radius_m)"}},
};
INSTANTIATE_TEST_SUITE_P(DepthCamera, Conflicts, testing::ValuesIn(kDepthCamera), nameOf);

const std::vector<Case> kHandle{
    {"UdpThatIsNotInUse", {"udp_handle.peer="}},
    {"UdpWithAPeer", {"handle.driver=udp", "udp_handle.peer=127.0.0.1:47801"}},
    {"UdpWithoutAPeer",
     {"handle.driver=udp"},
     {"udp_handle.peer: is empty, and the handle.driver udp needs it (set udp_handle.peer to the IPv4 "
      "address of "
      "the computer that holds the device)"}},
    {"UdpPeerThatTheAddressCannotReach",
     {"udp_handle.address=127.0.0.1", "udp_handle.peer=192.0.2.10"},
     {"udp_handle.address: 127.0.0.1 can be reached only from this computer, but udp_handle.peer is "
      "192.0.2.10 "
      "(set udp_handle.address to this computer's address in the peer's network, or to 0.0.0.0 for all)"}},
    {"UdpAddressWithAPort",
     {"udp_handle.address=192.0.2.1:5", "udp_handle.peer=192.0.2.10"},
     {"udp_handle.address: \"192.0.2.1:5\" names a port (write the address as 192.0.2.1, and the port in "
      "udp_handle.port)"}},
    {"HidByVendorAndProduct", {"hid_handle.device=046D:c626"}},
    {"HidByName",
     {"hid_handle.device=spacemouse"},
     {"hid_handle.device: \"spacemouse\" names no USB vendor and product (write them as lsusb shows them, "
      "four "
      "hexadecimal digits each: 046d:c626)"}},
    {"FalconWithFirmware", {"handle.driver=falcon", "falcon_handle.firmware=image.bin"}},
    {"FalconWithoutFirmware",
     {"handle.driver=falcon"},
     {"falcon_handle.firmware: is empty, and the handle.driver falcon needs it (set falcon_handle.firmware "
      "to the "
      "path of the image in Novint's driver)"}},
    {"DirectionOfApproach", {"simulated_handle.direction_z=0", "simulated_handle.direction_x=0.001"}},
    {"DirectionOfApproachThatIsZero",
     {"simulated_handle.direction_z=0", "simulated_handle.direction_x=1e-200"},
     {"simulated_handle.direction_x: (1e-200, 0, 0) is not a direction: it is shorter than 0.001 (set at "
      "least one "
      "of direction_x, direction_y and direction_z, as in 0, 0, -1)"}},
};
INSTANTIATE_TEST_SUITE_P(Handle, Conflicts, testing::ValuesIn(kHandle), nameOf);

const std::string kOwnLine = " (give each LED a line of its own, or leave one of the two empty)";
const std::vector<Case> kLeds{
    {"PowerLedAlone", {"leds.driver=gpiod", "leds.chip=box", "leds.power_line=1"}},
    {"CameraLedAlone", {"leds.driver=gpiod", "leds.chip=box", "leds.camera_line=1"}},
    {"ContactLedAlone", {"leds.driver=gpiod", "leds.chip=box", "leds.contact_line=1"}},
    {"FaultLedAlone", {"leds.driver=gpiod", "leds.chip=box", "leds.fault_line=1"}},
    {"ChipWithoutADriver", {"leds.chip=box"}},
    {"LineWithoutADriver", {"leds.power_line=1"}},
    {"DriverWithoutAChip",
     {"leds.driver=gpiod", "leds.power_line=1"},
     {"leds.chip: is empty, and the leds.driver gpiod needs it (set leds.chip to the label, the name or the "
      "path "
      "of a chip (gpiodetect lists them))"}},
    {"DriverWithoutALine",
     {"leds.driver=gpiod", "leds.chip=box"},
     {"leds.driver: gpiod has no LED to switch (set at least one of leds.power_line, leds.camera_line, "
      "leds.contact_line and leds.fault_line, or leds.driver to none)"}},
    {"DifferentLines", {"leds.power_line=0", "leds.camera_line=STATUS"}},
    {"TheSameOffsetTwice",
     {"leds.power_line=7", "leds.fault_line=007 active-low"},
     {"leds.fault_line: line 7 is also leds.power_line" + kOwnLine}},
    {"TheSameNameTwice",
     {"leds.camera_line=STATUS", "leds.contact_line=STATUS"},
     {"leds.contact_line: line \"STATUS\" is also leds.camera_line" + kOwnLine}},
    {"EachLineThatCannotBeRead",
     {"leds.power_line=99999", "leds.camera_line=5 active", "leds.contact_line=5"},
     {"leds.power_line: \"99999\" is not the offset of a line (allowed: 0..65535) (gpioinfo lists the lines "
      "of "
      "each chip)",
      "leds.camera_line: \"5 active\" does not end in \"active-low\" (write it as NAME, OFFSET, NAME "
      "active-low or "
      "OFFSET active-low)"}},
};
INSTANTIATE_TEST_SUITE_P(Leds, Conflicts, testing::ValuesIn(kLeds), nameOf);

const std::vector<Case> kSockets{
    {"LongestPath", {"control.status_socket=" + std::string(107, 's')}},
    {"PathThatIsTooLong",
     {"control.status_socket=" + std::string(108, 's')},
     {"control.status_socket: \"" + std::string(60, 's') +
      "...\" has 108 bytes, a socket's path at most 107 (choose a shorter path, or one relative to the "
      "working "
      "directory)"}},
    {"NoPath",
     {"control.control_socket="},
     {"control.control_socket: is empty (give the path of the socket)"}},
    {"PathOfAFolder",
     {"control.control_socket=run/"},
     {"control.control_socket: \"run/\" names a folder (give the path of the socket)"}},
    {"DifferentPaths", {"control.status_socket=run/a", "control.control_socket=run/b"}},
    {"TheSamePathTwice",
     {"control.status_socket=run/a", "control.control_socket=run/./a"},
     {"control.control_socket: \"run/./a\" is also control.status_socket (give the two sockets different "
      "paths)"}},
};
INSTANTIATE_TEST_SUITE_P(Sockets, Conflicts, testing::ValuesIn(kSockets), nameOf);

TEST(UdpPeer, IsOneComputer) {
  for (const char* peer : {"192.0.2.10", "192.0.2.10:1", "192.0.2.10:65535", "223.255.255.255"}) {
    for (const char* address : {"192.0.2.1", "0.0.0.0"})
      EXPECT_EQ(
          textsFor({fmt::format("udp_handle.address={}", address), fmt::format("udp_handle.peer={}", peer)}),
          Texts{})
          << peer;
  }
  for (const char* peer :
       {"device", "192.0.2", "192.0.2.256", "192.0.2.10:", "192.0.2.10:0", "192.0.2.10:65536",
        "192.0.2.10:1x", "192.0.2.10: 1", " 192.0.2.10", "::1", "0.0.0.0", "224.0.0.1", "255.255.255.255"}) {
    const Texts found = textsFor({"udp_handle.address=192.0.2.1", fmt::format("udp_handle.peer={}", peer)});
    ASSERT_EQ(found.size(), 1U) << peer;
    EXPECT_NE(found[0].find("write it as 192.0.2.10, or with a port as 192.0.2.10:47801"), std::string::npos);
  }
}

// The window is fixed; each law must find in it what it reaches with the largest values of its parameters,
// and one voxel on each side, because the window follows the HIP in whole voxels.
TEST(Window, HoldsTheReachOfEveryLawWithEveryValue) {
  const Settings settings = with({"force.radius_m=0.1", "contact.proxy_radius_m=0.03"});
  EXPECT_FALSE(findParameter("force.radius_m")->check(0.1001));
  EXPECT_FALSE(findParameter("contact.proxy_radius_m")->check(0.0301));
  for (const rt::ForceLawRow& law : rt::kForceLaws) {
    rt::LiveParameters live = settings.live;
    live.law = law.law;
    const double reach_m = rt::reachOfModel_m(rt::SceneNeeds::of(live), settings.grid);
    EXPECT_LE(2 * reach_m + 2 * settings.grid.voxel_edge_m,
              settings.grid.cells_per_axis * settings.grid.voxel_edge_m)
        << rt::wordOf(law.law);
  }
}

// Settings that did not pass the table, as a program could make them.
TEST(NumbersThatAreNotFinite, ViolateTheRules) {
  Settings settings = with({"camera.driver=v4l2", "force.law=nearest_springs"});
  settings.camera.near_m = std::nan("");
  settings.live.force.radius_m = std::nan("");
  settings.handle.of<drivers::SimulatedHandleSettings>().direction_in_world.x = std::nan("");
  EXPECT_EQ(checkTogether(settings).size(), 3U);
}

}  // namespace
}  // namespace hapticd::config
