// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "config/parameter_table.h"

namespace hapticd::config {
namespace {

Settings with(const std::vector<std::string>& changes) {
  Settings settings;
  for (const std::string& change : changes) {
    const Result<void> result = setFromText(settings, change);
    EXPECT_TRUE(result) << result.error().text();
  }
  return settings;
}

std::vector<std::string> textsFor(const std::vector<std::string>& changes) {
  std::vector<std::string> texts;
  for (const Error& error : checkTogether(with(changes))) texts.push_back(error.text());
  return texts;
}

using Texts = std::vector<std::string>;

bool contains(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

// Returns {"a.b=1", "c=2"} for "set a.b to at least 1, or c to at most 2"; parts of another form are omitted.
std::vector<std::string> changesIn(std::string remedy) {
  std::vector<std::string> changes;
  if (!remedy.starts_with("set ")) return changes;
  remedy = remedy.substr(4) + ", or ";
  for (std::size_t end = 0; (end = remedy.find(", or ")) != std::string::npos; remedy.erase(0, end + 5)) {
    const std::string part = remedy.substr(0, end);
    const std::size_t bound = std::min(part.find(" to at least "), part.find(" to at most "));
    if (bound == std::string::npos) continue;
    changes.push_back(part.substr(0, bound) + "=" + part.substr(part.rfind(' ') + 1));
  }
  return changes;
}

TEST(Conflicts, NearMustLieBelowFar) {
  EXPECT_EQ(textsFor({"camera.near_m=2", "camera.far_m=2.5"}), Texts{});
  EXPECT_EQ(
      textsFor({"camera.near_m=2", "camera.far_m=2"}),
      Texts{"camera.near_m: 2 m is not below camera.far_m, 2 m (set camera.near_m below camera.far_m)"});
  EXPECT_EQ(textsFor({"camera.near_m=5"}).size(), 1U);
}

TEST(Conflicts, MinPointsMayNotExceedMaxPoints) {
  EXPECT_EQ(textsFor({"force.min_points=100"}), Texts{});
  EXPECT_EQ(
      textsFor({"force.min_points=101"}),
      Texts{"force.min_points: 101 is above force.max_points, 100 (set force.min_points to at most 100 or "
            "force.max_points to at least 101)"});
}

TEST(Conflicts, TheUdpHandleNeedsAPeer) {
  EXPECT_EQ(textsFor({"udp_handle.peer="}), Texts{});
  EXPECT_EQ(textsFor({"handle.driver=udp", "udp_handle.peer=127.0.0.1:47801"}), Texts{});
  EXPECT_EQ(textsFor({"handle.driver=udp"}),
            Texts{"udp_handle.peer: is empty, and the handle.driver udp needs it (set udp_handle.peer to the "
                  "IPv4 address of the computer that holds the device)"});
}

TEST(Conflicts, AUdpPeerIsOneComputerThatTheAddressReaches) {
  const auto texts = [](const std::string& address, const std::string& peer) {
    return textsFor({"udp_handle.address=" + address, "udp_handle.peer=" + peer});
  };
  for (const char* peer : {"192.0.2.10", "192.0.2.10:1", "192.0.2.10:65535", "223.255.255.255"}) {
    EXPECT_EQ(texts("192.0.2.1", peer), Texts{}) << peer;
    EXPECT_EQ(texts("0.0.0.0", peer), Texts{}) << peer;
  }
  for (const char* peer :
       {"device", "192.0.2", "192.0.2.256", "192.0.2.10:", "192.0.2.10:0", "192.0.2.10:65536",
        "192.0.2.10:1x", "192.0.2.10: 1", " 192.0.2.10", "::1", "0.0.0.0", "224.0.0.1", "255.255.255.255"}) {
    const Texts found = texts("192.0.2.1", peer);
    ASSERT_EQ(found.size(), 1U) << peer;
    EXPECT_NE(found[0].find("write it as 192.0.2.10, or with a port as 192.0.2.10:47801"), std::string::npos);
  }
  EXPECT_EQ(texts("127.0.0.1", "192.0.2.10"), Texts{"udp_handle.address: 127.0.0.1 can be reached only from "
                                                    "this computer, but udp_handle.peer is 192.0.2.10 "
                                                    "(set udp_handle.address to this computer's address in "
                                                    "the peer's network, or to 0.0.0.0 for all)"});
  EXPECT_EQ(
      texts("192.0.2.1:5", "192.0.2.10"),
      Texts{
          "udp_handle.address: \"192.0.2.1:5\" names a port (write the address as 192.0.2.1, and the port in "
          "udp_handle.port)"});
  EXPECT_EQ(texts("here", "").size(), 1U);
}

TEST(Conflicts, ADepthLawNeedsAValidRawValue) {
  EXPECT_EQ(
      textsFor({"camera.depth_law=custom", "camera.depth_a_per_m=-0.0029", "camera.depth_b_per_m=3.15"}),
      Texts{});
  // 1/Z stays below 0: everything is behind the camera.
  EXPECT_EQ(
      textsFor({"camera.depth_law=custom", "camera.depth_a_per_m=-0.003", "camera.depth_b_per_m=-1"}),
      Texts{"camera.depth_law: Z = 1 / (-0.003 d + -1) lies between camera.near_m, 0.4 m, and camera.far_m, "
            "4 m, for no raw value d of 0..2046 (correct camera.depth_a_per_m and camera.depth_b_per_m: "
            "about -0.003 and 3.3 for a Kinect v1)"});
  // Only the configured law is checked.
  EXPECT_EQ(textsFor({"camera.depth_a_per_m=-0.003", "camera.depth_b_per_m=-1"}), Texts{});
}

TEST(Conflicts, ConfiguredIntrinsicsAreNotThoseOfAKinect) {
  EXPECT_EQ(textsFor({"camera.driver=v4l2"}), Texts{});
  EXPECT_EQ(
      textsFor({"camera.driver=v4l2", "camera.intrinsics=configured"}),
      Texts{"camera.intrinsics: configured takes camera.fx_px and camera.fy_px, which are still those of a "
            "Kinect v1 (set camera.fx_px, camera.fy_px, camera.cx_px and camera.cy_px for the chosen size "
            "of the frames)"});
  EXPECT_EQ(textsFor({"camera.driver=v4l2", "camera.intrinsics=configured", "camera.fx_px=430",
                      "camera.fy_px=430", "camera.cx_px=424"}),
            Texts{});
  EXPECT_EQ(
      textsFor({"camera.driver=v4l2", "camera.intrinsics=configured", "camera.fx_px=430", "camera.fy_px=430",
                "camera.cx_px=900"}),
      Texts{"camera.cx_px: the optical centre (900, 242.739138) lies outside the frame of 848 x 480 pixels "
            "(set camera.cx_px and camera.cy_px for the chosen size of the frames)"});
}

TEST(Conflicts, AFrameHasItsUsualSizeOrALeastOne) {
  for (const char* size :
       {"camera.width_px=0", "camera.width_px=160", "camera.height_px=0", "camera.height_px=100"})
    EXPECT_EQ(textsFor({size}), Texts{}) << size;
  EXPECT_EQ(textsFor({"camera.width_px=159"}),
            Texts{"camera.width_px: 159 px is below 160 px (set camera.width_px to at least 160, or to 0 for "
                  "the usual size of the camera)"});
  EXPECT_EQ(textsFor({"camera.height_px=1"}),
            Texts{"camera.height_px: 1 px is below 100 px (set camera.height_px to at least 100, or to 0 for "
                  "the usual size of the camera)"});
}

TEST(Conflicts, ADepthUnitReachesTheNearLimit) {
  EXPECT_EQ(textsFor({"camera.driver=v4l2", "camera.unit_um=10"}), Texts{});
  EXPECT_EQ(textsFor({"camera.driver=v4l2", "camera.unit_um=1"}),
            Texts{"camera.unit_um: 16 bits of 1 um end at 0.065535 m, nearer than camera.near_m, 0.4 m (set "
                  "camera.unit_um to 100 or 1000, or to 0)"});
}

TEST(Conflicts, TheRulesForDepthCamerasHoldForThoseThatAreSynthetic) {
  const auto texts = [](std::string_view camera, std::vector<std::string> set) {
    set.insert(set.begin(), {"camera.driver=synthetic", fmt::format("synthetic.camera={}", camera)});
    return textsFor(set);
  };
  for (const char* camera : {"kinect", "stereo", "time_of_flight"})
    EXPECT_EQ(texts(camera, {}), Texts{}) << camera;
  EXPECT_EQ(texts("kinect", {"camera.intrinsics=configured", "camera.unit_um=1"}), Texts{});
  EXPECT_EQ(texts("stereo", {"camera.intrinsics=configured"}).size(), 1U);
  EXPECT_EQ(texts("stereo", {"camera.unit_um=1"}).size(), 1U);
  EXPECT_EQ(
      texts("time_of_flight", {"camera.intrinsics=configured", "camera.fx_px=430", "camera.cx_px=700"}),
      Texts{"camera.cx_px: the optical centre (700, 242.739138) lies outside the frame of 640 x 576 pixels "
            "(set camera.cx_px and camera.cy_px for the chosen size of the frames)"});
  EXPECT_EQ(texts("stereo", {"force.law=nearest_springs", "camera.unit_um=71"}), Texts{});
  EXPECT_EQ(texts("stereo", {"force.law=nearest_springs", "camera.unit_um=70"}).size(), 1U);
}

// 2047 units of 1 mm are less than 4 m - 0.4 m, which takes 1.7588 mm.
TEST(Conflicts, ASceneOfTheWholeFrameHoldsTheDepthOfTheCamera) {
  const auto texts = [](std::vector<std::string> set) {
    set.insert(set.begin(),
               {"camera.driver=synthetic", "synthetic.camera=time_of_flight", "grid.extent=frame"});
    return textsFor(set);
  };
  EXPECT_EQ(texts({}),
            Texts{"camera.unit_um: a scene of the whole frame holds 2.047 m of depth in units of 1000 um, "
                  "but from camera.near_m to camera.far_m it is 3.6 m (set camera.unit_um to at least "
                  "1759, or grid.extent to reach)"});
  EXPECT_EQ(texts({"camera.unit_um=1759"}), Texts{});
  EXPECT_EQ(texts({"camera.far_m=2.4"}), Texts{});
  EXPECT_EQ(textsFor({"camera.driver=v4l2", "grid.extent=frame"}), Texts{})
      << "the camera's unit is not known yet";
}

TEST(Conflicts, ADepthUnitIsCoarseEnoughForTheReachOfLawsOnPoints) {
  EXPECT_EQ(textsFor({"camera.driver=v4l2", "force.law=nearest_springs"}), Texts{});
  EXPECT_EQ(textsFor({"camera.driver=v4l2", "force.law=nearest_springs", "camera.unit_um=71"}), Texts{});
  EXPECT_EQ(textsFor({"camera.driver=v4l2", "force.law=nearest_springs", "camera.unit_um=70"}),
            Texts{"camera.unit_um: a scene holds 0.1431 m of depth in units of 70 um, but the law "
                  "nearest_springs needs 0.144 m: 0.072 m on each side: 0.04 m that it looks at + "
                  "grid.max_hip_speed_m_per_s 0.6 m/s * 0.05333 s of frame period and margin (set "
                  "camera.unit_um to at least 71, or lower force.radius_m or grid.max_hip_speed_m_per_s)"});
  EXPECT_EQ(textsFor({"camera.driver=v4l2", "force.law=surface", "camera.unit_um=10"}), Texts{});
}

TEST(Conflicts, LimitsBetweenTwoRawValuesHoldNoDepth) {
  // Table I: raw 1052 is 9.991 m, raw 1053 is 10.308 m.
  const Texts texts = textsFor({"camera.near_m=9.995", "camera.far_m=10"});
  ASSERT_EQ(texts.size(), 1U);
  EXPECT_TRUE(texts[0].ends_with("(move camera.near_m and camera.far_m further apart)")) << texts[0];
}

TEST(Conflicts, TheRecordedDriverNeedsARecording) {
  EXPECT_EQ(textsFor({"camera.driver=recorded", "camera.recording=somewhere"}), Texts{});
  EXPECT_EQ(
      textsFor({"camera.driver=recorded"}),
      Texts{"camera.recording: is empty, and the camera.driver recorded needs it (set camera.recording to "
            "the folder that holds INDEX.txt or camera.yaml)"});
}

TEST(Conflicts, TheHandlesThreadIsLessUrgentThanTheForceThread) {
  EXPECT_EQ(textsFor({"handle.thread_priority=79"}), Texts{});
  EXPECT_EQ(textsFor({"handle.thread_priority=0", "loop.priority=1"}), Texts{});
  EXPECT_EQ(
      textsFor({"handle.thread_priority=50", "loop.priority=50"}),
      Texts{"handle.thread_priority: 50 is not below the loop.priority 50, and the handle's thread must "
            "never make the force loop wait (set handle.thread_priority to at most 49, or to -1)"});
}

TEST(Conflicts, TheFalconNeedsAFirmwareImage) {
  EXPECT_EQ(textsFor({"handle.driver=falcon", "falcon_handle.firmware=image.bin"}), Texts{});
  EXPECT_EQ(textsFor({"handle.driver=falcon"}),
            Texts{"falcon_handle.firmware: is empty, and the handle.driver falcon needs it (set "
                  "falcon_handle.firmware to the path of the image in Novint's driver)"});
}

TEST(Conflicts, TheDirectionOfApproachIsNotZero) {
  EXPECT_EQ(textsFor({"simulated_handle.direction_z=0", "simulated_handle.direction_x=0.001"}), Texts{});
  const Texts texts = textsFor({"simulated_handle.direction_z=0", "simulated_handle.direction_x=1e-200"});
  ASSERT_EQ(texts.size(), 1U);
  EXPECT_EQ(texts[0],
            "simulated_handle.direction_x: (1e-200, 0, 0) is not a direction: it is shorter than 0.001 (set "
            "at least "
            "one of direction_x, direction_y and direction_z, as in 0, 0, -1)");
}

TEST(Conflicts, ASocketPathHasAtMost107Bytes) {
  EXPECT_EQ(textsFor({"control.status_socket=" + std::string(107, 's')}), Texts{});
  EXPECT_EQ(
      textsFor({"control.status_socket=" + std::string(108, 's')}),
      Texts{"control.status_socket: \"" + std::string(60, 's') +
            "...\" has 108 bytes, a socket's path at most 107 (choose a shorter path, or one relative to "
            "the working directory)"});
  EXPECT_EQ(textsFor({"control.control_socket="}),
            Texts{"control.control_socket: is empty (give the path of the socket)"});
  EXPECT_EQ(textsFor({"control.control_socket=run/"}),
            Texts{"control.control_socket: \"run/\" names a folder (give the path of the socket)"});
}

TEST(Conflicts, TheTwoSocketsHaveDifferentPaths) {
  const Texts expected{
      "control.control_socket: \"run/./a\" is also control.status_socket (give the two sockets "
      "different paths)"};
  EXPECT_EQ(textsFor({"control.status_socket=run/a", "control.control_socket=run/./a"}), expected);
  EXPECT_EQ(textsFor({"control.status_socket=run/a", "control.control_socket=run/b"}), Texts{});
}

// 2 * (0.04 + 0.6 * (1/30 + 0.02)) + 2 * 0.01 = 0.164 m are needed: 17 voxels of 0.01 m.
TEST(Conflicts, TheWindowHoldsTheReachFromTheComputedNumberOfVoxelsOn) {
  EXPECT_EQ(textsFor({"force.law=nearest_springs", "grid.cells_per_axis=17"}), Texts{});
  EXPECT_EQ(
      textsFor({"force.law=nearest_springs", "grid.cells_per_axis=16"}),
      Texts{
          "grid.cells_per_axis: 16 voxels of 0.01 m make a window of 0.16 m, but the law nearest_springs "
          "needs 0.164 m: 0.072 m on each side: 0.04 m that it looks at + grid.max_hip_speed_m_per_s 0.6 m/s "
          "* 0.05333 s of frame period and margin, and one voxel (set grid.cells_per_axis to at least 17, or "
          "grid.voxel_edge_m to at least 0.0103, or grid.max_hip_speed_m_per_s to at most 0.562, or "
          "force.radius_m to at most 0.0379)"});
}

// The proxy needs 0.04 m + 2 * 0.008 m + 0.008 m = 0.064 m, whatever the radius of the springs is: 2 * (0.064
// + 0.6 * (1/30 + 0.02)) + 2 * 0.004 = 0.2 m.
TEST(Conflicts, TheWindowCoversWhatTheLawInUseNeeds) {
  const std::vector<std::string> small{"grid.voxel_edge_m=0.004", "force.radius_m=0.02"};
  std::vector<std::string> with_proxy = small;
  with_proxy.emplace_back("force.law=proxy");
  const Texts texts = textsFor(with_proxy);
  ASSERT_EQ(texts.size(), 1U);
  EXPECT_TRUE(texts[0].starts_with(
      "grid.cells_per_axis: 32 voxels of 0.004 m make a window of 0.128 m, but the law proxy needs 0.2 m"))
      << texts[0];
  EXPECT_TRUE(contains(texts[0],
                       "set grid.cells_per_axis to at least 51, or grid.voxel_edge_m to at least "
                       "0.00641"))
      << texts[0];
  EXPECT_EQ(textsFor(small), Texts{});  // auto chooses the law surface with these settings
}

// With a large allowed error, auto chooses the springs far away.
TEST(Conflicts, TheWindowCoversWhatTheLawsNeedThatAutoMayChoose) {
  const std::vector<std::string> tolerant{"force.max_error_n=10", "force.stiffness_n_per_m=100",
                                          "grid.cells_per_axis=16"};
  const Texts texts = textsFor(tolerant);
  ASSERT_EQ(texts.size(), 1U);
  EXPECT_TRUE(contains(texts[0], ", which auto may choose, needs ")) << texts[0];
}

// It works on the image, not on a window of voxels.
TEST(Conflicts, TheLawSurfaceNeedsNoWindow) {
  EXPECT_EQ(textsFor({"force.law=surface", "grid.max_hip_speed_m_per_s=5", "grid.cells_per_axis=8"}),
            Texts{});
}

TEST(Conflicts, TheWindowDoesNotMatterWhileTheWholeFrameIsModelled) {
  EXPECT_EQ(textsFor({"force.law=proxy", "grid.cells_per_axis=8", "grid.extent=frame"}), Texts{});
}

// Every value named in a remedy resolves the conflict by itself.
TEST(Conflicts, EveryRemedyForTheWindowResolvesTheConflict) {
  int remedies = 0;
  for (const char* law : {"nearest_springs", "proxy", "surface", "auto"})
    for (const char* cells : {"8", "19", "32", "64"}) {
      for (const char* edge : {"0.002", "0.0033", "0.007"}) {
        for (const char* speed : {"0", "0.37", "1.9"}) {
          for (const char* radius : {"0.005", "0.031", "0.1"}) {
            const Settings settings = with(
                {std::string("force.law=") + law, std::string("grid.cells_per_axis=") + cells,
                 std::string("grid.voxel_edge_m=") + edge, std::string("grid.max_hip_speed_m_per_s=") + speed,
                 std::string("force.radius_m=") + radius});
            for (const Error& error : checkTogether(settings)) {
              for (const std::string& change : changesIn(error.remedy)) {
                Settings changed = settings;
                ASSERT_TRUE(setFromText(changed, change)) << change;
                EXPECT_TRUE(checkTogether(changed).empty())
                    << change << " does not resolve: " << error.text();
                ++remedies;
              }
            }
          }
        }
      }
    }
  EXPECT_GT(remedies, 100);
}

TEST(Conflicts, AWindowThatNoSingleChangeFixesIsRefusedToo) {
  const Texts texts =
      textsFor({"force.law=nearest_springs", "grid.cells_per_axis=8", "grid.voxel_edge_m=0.002",
                "force.radius_m=0.1", "grid.max_hip_speed_m_per_s=5", "grid.frame_period_s=1"});
  ASSERT_EQ(texts.size(), 1U);
  EXPECT_TRUE(texts[0].ends_with("one alone is not enough)")) << texts[0];
}

TEST(Conflicts, AFrameGridThatTakesTooMuchMemoryIsRefusedWithACoarserEdge) {
  const std::vector<std::string> changes{"grid.extent=frame", "grid.frame_voxel_edge_m=0.01",
                                         "camera.far_m=10"};
  const std::vector<Error> errors = checkTogether(with(changes));
  ASSERT_EQ(errors.size(), 1U);
  EXPECT_EQ(errors[0].where, "grid.frame_voxel_edge_m");
  EXPECT_TRUE(errors[0].remedy.ends_with(", or camera.far_m below 10 m")) << errors[0].remedy;
  const std::vector<std::string> remedies = changesIn(errors[0].remedy);
  ASSERT_EQ(remedies.size(), 1U);
  Settings changed = with(changes);
  ASSERT_TRUE(setFromText(changed, remedies[0])) << remedies[0];
  EXPECT_TRUE(checkTogether(changed).empty());
}

TEST(Conflicts, TheFrameGridOfTheDefaultsFits) {
  EXPECT_EQ(textsFor({"grid.extent=frame"}), Texts{});
}

TEST(Conflicts, SeveralViolatedRulesAreAllReported) {
  EXPECT_EQ(textsFor({"camera.near_m=5", "force.min_points=200", "control.status_socket="}).size(), 3U);
}

// Settings that did not pass the table, as a program could make them.
TEST(Conflicts, NumbersThatAreNotFiniteViolateTheRules) {
  Settings settings;
  settings.camera.depth_model.near_m = std::nan("");
  settings.force.law = rt::ForceLaw::nearest_springs;
  settings.live.springs.radius_m = std::nan("");
  settings.handle.simulated.direction_in_world.x = std::nan("");
  EXPECT_EQ(checkTogether(settings).size(), 3U);
}

TEST(Conflicts, AHidHandleIsNamedByVendorAndProduct) {
  EXPECT_EQ(textsFor({"hid_handle.device=046D:c626"}), Texts{});
  EXPECT_EQ(textsFor({"hid_handle.device=spacemouse"}),
            Texts{"hid_handle.device: \"spacemouse\" names no USB vendor and product (write them as lsusb "
                  "shows them, four hexadecimal digits each: 046d:c626)"});
}

}  // namespace
}  // namespace hapticd::config
