// SPDX-License-Identifier: Apache-2.0
// What the camera of a running hapticd sees and the fixtures in it, as a program of DDS hears them.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ros_messages.h"
#include "rt/base/clock.h"
#include "tests/ros/box_on_the_wire.h"
#include "tests/support/file_content.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::test {
namespace {

constexpr uid_t kNobody = 65534;

/// A tilted wall before a camera that stands askew.
constexpr double kTilt_rad = 0.3;
constexpr double kDistance_m = 1.2;
const std::string kAskewYaml =
    "safety: {handle_timeout_s: 1, depth_timeout_s: 5, overrun_burst: 65}\n"
    "camera: {driver: synthetic, position_x_m: 0.1, position_y_m: -0.2, position_z_m: 0.3, roll_rad: 0.4, "
    "pitch_rad: -0.5, yaw_rad: 0.6}\n"
    "synthetic: {scene: plane, noise: off, distance_m: 1.2, tilt_rad: 0.3}\n"
    "simulated_handle: {start_z_m: -0.5}\n";

/// How the depths of the camera, a Kinect v1, are rounded: to whole raw values of 1/Z = a raw + b.
constexpr double kStep_per_m = 0.003071102;

class SceneOnTheWire : public BoxOnTheWire {
 protected:
  void listenToPoints() {
    listener_.subscribe(topic("scene/points"), sensor_msgs_msg_dds__PointCloud2__desc);
  }
  void listenToFixtures(RosListener& listener) {
    listener.subscribe(topic("fixtures"), visualization_msgs_msg_dds__MarkerArray__desc, /*late=*/true);
  }
  /// Waits until the newest array has markers of just these fixtures.
  bool fixturesBecome(RosListener& listener, const std::vector<std::string>& names) {
    return becomesTrue([&] {
      for (const std::string& message : listener.take(topic("fixtures"))) markers_ = markersFrom(message);
      if (markers_.empty()) return false;
      std::vector<std::string> shown;
      for (std::size_t i = 1; i < markers_.size(); ++i) {
        if (shown.empty() || shown.back() != markers_[i].name) shown.push_back(markers_[i].name);
      }
      return shown == names;
    });
  }

  std::vector<MarkerHeard> markers_;
};

/// Whether a process has the memory of the depth frames mapped.
bool sharesDepth(const Program& program) {
  return contentOf("/proc/" + std::to_string(program.pid()) + "/maps").find("hapticd-depth") !=
         std::string::npos;
}

TEST_F(SceneOnTheWire, IsAnnouncedAsRos2ExpectsIt) {
  startBridge();
  const std::map<std::string, std::pair<std::string, std::string>> expected{
      {topic("scene/points"),
       {"sensor_msgs::msg::dds_::PointCloud2_",
        "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"}},
      {topic("depth/image_raw"),
       {"sensor_msgs::msg::dds_::Image_",
        "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"}},
      {topic("depth/camera_info"),
       {"sensor_msgs::msg::dds_::CameraInfo_",
        "b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275"}},
      {topic("fixtures"),
       {"visualization_msgs::msg::dds_::MarkerArray_",
        "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf"}}};
  for (const auto& [name, type] : expected) {
    std::optional<WriterSeen> seen;
    ASSERT_TRUE(becomesTrue([&] { return (seen = listener_.writerOf(name)).has_value(); }))
        << name << bridge_->errors();
    EXPECT_EQ(seen->type, type.first);
    EXPECT_EQ(seen->user_data, "typehash=RIHS01_" + type.second + ";");
    EXPECT_TRUE(seen->reliable) << name;
    EXPECT_EQ(seen->transient_local, name == topic("fixtures")) << name;
  }
}

TEST_F(SceneOnTheWire, IsReadOnlyWhileSomebodySubscribes) {
  Daemon daemon(home_, kWallYaml);
  ASSERT_TRUE(daemon.answers());
  startBridge();
  // what it says of fixtures, it has asked hapticd for
  listenToFixtures(listener_);
  ASSERT_TRUE(fixturesBecome(listener_, {})) << bridge_->errors();
  EXPECT_FALSE(sharesDepth(*bridge_));
  EXPECT_FALSE(sharesDepth(daemon));
  for (int i = 0; i < 2; ++i) {
    std::optional<RosListener> passing(std::in_place, domain_);
    passing->subscribe(topic("scene/points"), sensor_msgs_msg_dds__PointCloud2__desc);
    ASSERT_TRUE(becomesTrue([&] { return !passing->take(topic("scene/points")).empty(); }))
        << bridge_->errors();
    EXPECT_TRUE(sharesDepth(*bridge_));
    EXPECT_TRUE(sharesDepth(daemon));
    passing.reset();
    EXPECT_TRUE(becomesTrue([&] { return !sharesDepth(*bridge_) && !sharesDepth(daemon); }));
  }
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST_F(SceneOnTheWire, IsThatOfTheCameraInItsOpticalFrame) {
  Daemon daemon(home_, kAskewYaml);
  ASSERT_TRUE(daemon.answers());
  startBridge();
  listenToPoints();
  listener_.subscribe(topic("depth/image_raw"), sensor_msgs_msg_dds__Image__desc);
  listener_.subscribe(topic("depth/camera_info"), sensor_msgs_msg_dds__CameraInfo__desc);
  listener_.subscribe("rt/tf_static", tf2_msgs_msg_dds__TFMessage__desc, /*late=*/true);
  const std::int64_t begin_ns = rt::realtimeNow_ns();

  // by time of measurement
  std::map<std::int64_t, CloudHeard> clouds;
  std::map<std::int64_t, DepthHeard> images;
  std::map<std::int64_t, CameraHeard> cameras;
  std::map<std::string, std::pair<std::string, rt::RigidPose>> frames;
  std::optional<std::int64_t> common_ns;
  ASSERT_TRUE(becomesTrue([&] {
    for (const std::string& message : listener_.take("rt/tf_static")) frames = framesFrom(message);
    for (const std::string& message : listener_.take(topic("scene/points"))) {
      const CloudHeard cloud = cloudFrom(message);
      clouds[cloud.header.time_ns] = cloud;
    }
    for (const std::string& message : listener_.take(topic("depth/image_raw"))) {
      const DepthHeard image = depthFrom(message);
      images[image.header.time_ns] = image;
    }
    for (const std::string& message : listener_.take(topic("depth/camera_info"))) {
      const CameraHeard camera = cameraFrom(message);
      cameras[camera.header.time_ns] = camera;
    }
    for (const auto& [time_ns, cloud] : clouds) {
      if (images.contains(time_ns) && cameras.contains(time_ns)) common_ns = time_ns;
    }
    return common_ns && !frames.empty();
  })) << bridge_->errors();

  const CloudHeard& cloud = clouds.at(*common_ns);
  const DepthHeard& image = images.at(*common_ns);
  const CameraHeard& camera = cameras.at(*common_ns);
  EXPECT_EQ(cloud.header.frame, namespace_ + "/camera_optical");
  EXPECT_EQ(image.header.frame, namespace_ + "/camera_optical");
  EXPECT_EQ(camera.header.frame, namespace_ + "/camera_optical");
  // measured since the bridge was asked, but for the frame that was the newest then and may be up to the age
  // at which hapticd gives its camera up
  EXPECT_GT(*common_ns, begin_ns - 5 * rt::kNsPerSecond);
  EXPECT_LT(*common_ns, rt::realtimeNow_ns());

  // all pixels are measured, and each is a point, in the same order
  ASSERT_EQ(image.width, 640U);
  ASSERT_EQ(image.height, 480U);
  const auto measured = static_cast<std::size_t>(
      std::ranges::count_if(image.depth_mm, [](std::uint16_t mm) { return mm != 0; }));
  EXPECT_GT(measured, 100'000U);
  ASSERT_EQ(cloud.xyz_m.size(), 3 * measured);
  const rt::RigidPose T_world_camera = frames.at(namespace_ + "/camera").second;
  const rt::RigidPose T_camera_optical = frames.at(namespace_ + "/camera_optical").second;
  // of the wall, from its definition: through the point straight ahead, turned about x
  const rt::Vec3 normal_in_camera{0, -std::sin(kTilt_rad), std::cos(kTilt_rad)};
  const rt::Vec3 normal = rt::rotated(T_world_camera.orientation, normal_in_camera);
  const rt::Vec3 ahead = rt::placed(T_world_camera, {0, 0, -kDistance_m});
  std::size_t at = 0;
  std::size_t faults = 0;
  for (std::size_t pixel = 0; pixel < image.depth_mm.size(); ++pixel) {
    if (image.depth_mm[pixel] == 0) continue;
    const rt::Vec3 optical{cloud.xyz_m[at], cloud.xyz_m[at + 1], cloud.xyz_m[at + 2]};
    at += 3;
    const auto column = static_cast<double>(pixel % image.width);
    const auto row = static_cast<double>(pixel / image.width);
    // where that pixel is by the pinhole model of the camera info; single precision of coordinates below 8 m
    constexpr double kRounding_m = 1e-6;
    const bool is_seen_there =
        std::abs(optical.x - (column - camera.k[2]) * optical.z / camera.k[0]) < kRounding_m &&
        std::abs(optical.y - (row - camera.k[5]) * optical.z / camera.k[4]) < kRounding_m;
    const bool is_as_deep = std::abs(1000 * optical.z - image.depth_mm[pixel]) <= 0.5 + 1000 * kRounding_m;
    const rt::Vec3 in_world = rt::placed(T_world_camera, rt::placed(T_camera_optical, optical));
    // the depth is rounded to a whole raw value, by up to half a step of 1/Z; along the ray that moves the
    // point off the wall by no more than the ray's length allows
    const double depth_error_m = 0.5 * kStep_per_m * optical.z * (optical.z + 0.01);
    const double off_m = std::abs(rt::dot(in_world - ahead, normal));
    const bool is_on_wall = off_m <= depth_error_m * rt::norm(optical) / optical.z + kRounding_m;
    if (!is_seen_there || !is_as_deep || !is_on_wall) ++faults;
  }
  EXPECT_EQ(faults, 0U);
}

TEST_F(SceneOnTheWire, HasFixturesThatAreAddedAndDeleted) {
  Daemon daemon(home_, kWallYaml);
  ASSERT_TRUE(daemon.answers());
  startBridge();
  listenToFixtures(listener_);
  ASSERT_TRUE(fixturesBecome(listener_, {})) << bridge_->errors();
  const auto control = [this](const std::vector<std::string>& arguments) {
    const Finished finished = home_.control(arguments);
    EXPECT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  };
  control(
      {"fixture", "add", "ball", "--kind", "sphere", "--position-m", "0.1,0.2,-0.5", "--radius-m", "0.05"});
  control({"fixture", "add", "way", "--kind", "path", "--points-m", "0,0,-0.8 0.1,0,-0.8"});
  ASSERT_TRUE(fixturesBecome(listener_, {"ball", "way"})) << bridge_->errors();
  // those that come later get the same
  RosListener late(domain_);
  listenToFixtures(late);
  ASSERT_TRUE(fixturesBecome(late, {"ball", "way"})) << bridge_->errors();
  ASSERT_EQ(markers_.size(), 3U);
  EXPECT_EQ(markers_[0].action, 3);  // all that were there are deleted
  for (const MarkerHeard& marker : markers_) EXPECT_EQ(marker.header.frame, namespace_ + "/world");
  EXPECT_EQ(markers_[1].type, 2);  // a sphere
  EXPECT_EQ(markers_[1].action, 0);
  EXPECT_EQ(markers_[1].pose.position_m_in_world, (rt::Vec3{0.1, 0.2, -0.5}));
  EXPECT_EQ(markers_[1].scale_m, (rt::Vec3{0.1, 0.1, 0.1}));
  EXPECT_GT(markers_[1].colour[0], markers_[1].colour[1] + markers_[1].colour[2]);  // red
  EXPECT_EQ(markers_[2].type, 4);                                                   // a line
  EXPECT_EQ(markers_[2].points_m, (std::vector<rt::Vec3>{{0, 0, -0.8}, {0.1, 0, -0.8}}));

  control({"fixture", "remove", "ball"});
  ASSERT_TRUE(fixturesBecome(listener_, {"way"})) << bridge_->errors();
  EXPECT_EQ(markers_[0].action, 3);
  // a hapticd that has gone has no fixtures
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
  EXPECT_TRUE(fixturesBecome(listener_, {})) << bridge_->errors();
}

TEST_F(SceneOnTheWire, MovesFixturesWithTheirFrame) {
  Daemon daemon(home_, std::string(kWallYaml) +
                           "frames: [{name: tool, timeout_s: 10}]\n"
                           "fixtures: [{name: ball, kind: sphere, frame: tool, radius_m: 0.05, position_m: "
                           "[0.1, 0, 0]}]\n");
  ASSERT_TRUE(daemon.answers());
  startBridge();
  listenToFixtures(listener_);
  ASSERT_TRUE(fixturesBecome(listener_, {"ball"})) << bridge_->errors();
  EXPECT_EQ(markers_.at(1).type, 9) << "a frame without a pose: its fixtures are named only";
  auto client = tools::VarlinkClient::connect(home_.controlSocket());
  ASSERT_TRUE(client) << client.error().what;
  // a quarter turn about z; fed until the force loop has followed it
  const tools::Json pose{{"frame", "tool"},
                         {"positionM", {0, 0, -0.5}},
                         {"orientationXyzw", {0, 0, std::sqrt(0.5), std::sqrt(0.5)}}};
  constexpr double kRounding_m = 1e-6;
  ASSERT_TRUE(becomesTrue(
      [&] {
        const auto fed = client->call("io.hapticd.Control.FeedPose", pose);
        EXPECT_TRUE(fed) << fed.error().what << fed.error().parameters.dump();
        for (const std::string& message : listener_.take(topic("fixtures"))) markers_ = markersFrom(message);
        const rt::Vec3& centre = markers_.back().pose.position_m_in_world;
        return !fed || (markers_.back().type == 2 && rt::norm(centre - rt::Vec3{0, 0.1, -0.5}) < kRounding_m);
      },
      std::chrono::milliseconds(20)))
      << bridge_->errors();
}

TEST_F(SceneOnTheWire, ComesBackWithADaemonThatWasKilled) {
  std::optional<Daemon> daemon(std::in_place, home_, kWallYaml);
  ASSERT_TRUE(daemon->answers());
  startBridge();
  listenToPoints();
  ASSERT_TRUE(hears("scene/points")) << bridge_->errors();
  daemon->signal(SIGKILL);
  (void)daemon->wait();
  ASSERT_TRUE(becomesTrue([&] { return !sharesDepth(*bridge_); }));
  (void)listener_.take(topic("scene/points"));
  daemon.emplace(home_, kWallYaml);
  EXPECT_TRUE(hears("scene/points")) << bridge_->errors();
  bridge_->signal(SIGTERM);
  EXPECT_EQ(bridge_->wait(), exitedWith(0)) << bridge_->errors();
}

TEST_F(SceneOnTheWire, DoesNotStopTheTicksForASubscriberThatHangs) {
  Daemon daemon(home_, kEngagedYaml);
  ASSERT_TRUE(daemon.answers());
  startBridge({"--cloud-rate", "30"});
  Program deaf({DEAF_LISTENER, std::to_string(domain_), topic("scene/points")});
  ASSERT_TRUE(becomesTrue([&] { return deaf.output().contains("hears"); })) << bridge_->errors();
  deaf.signal(SIGSTOP);
  listener_.subscribe(topic("setpoint_cf"), geometry_msgs_msg_dds__WrenchStamped__desc);
  listenToPoints();
  std::size_t forces = 0;
  std::size_t clouds = 0;
  // many times what a writer keeps for a reader that is late
  EXPECT_TRUE(becomesTrue([&] {
    forces += listener_.take(topic("setpoint_cf")).size();
    clouds += listener_.take(topic("scene/points")).size();
    return forces > 500 && clouds > 20;
  })) << forces
      << " forces, " << clouds << " clouds; " << bridge_->errors();
  bridge_->signal(SIGTERM);
  EXPECT_EQ(bridge_->wait(), exitedWith(0)) << bridge_->errors();
}

TEST_F(SceneOnTheWire, IsRefusedInWordsToWhoMayNotSeeTheDepthImage) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root to be another user";
  Daemon daemon(home_, kEngagedYaml);
  ASSERT_TRUE(daemon.answers());
  std::filesystem::permissions(home_.path(), std::filesystem::perms::all);
  startBridge({}, {.user = kNobody});
  listener_.subscribe(topic("setpoint_cf"), geometry_msgs_msg_dds__WrenchStamped__desc);
  listenToPoints();
  EXPECT_TRUE(says("the depth image is for root and the groups haptic and haptic-view"));
  EXPECT_TRUE(hears("setpoint_cf")) << bridge_->errors();
  // once, however often it tries; it does so once a second
  const std::int64_t until_ns = rt::monotonicNow_ns() + 3 * rt::kNsPerSecond;
  EXPECT_TRUE(becomesTrue([&] { return rt::monotonicNow_ns() > until_ns; }));
  EXPECT_EQ(timesSaid("the depth image is for root"), 1U) << bridge_->errors();
  EXPECT_TRUE(listener_.take(topic("scene/points")).empty());
}

TEST_F(SceneOnTheWire, RefusesARateThatNoCameraHas) {
  startBridge({"--cloud-rate", "31"});
  EXPECT_EQ(bridge_->wait(), exitedWith(64));
  EXPECT_TRUE(contains(bridge_->errors(), "--cloud-rate"));
}

}  // namespace
}  // namespace hapticd::test
