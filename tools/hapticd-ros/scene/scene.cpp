// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/scene/scene.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string_view>
#include <utility>

#include "rt/base/clock.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools::ros {
namespace {

/// Between two looks at whether somebody subscribes.
constexpr int kRestMs = 100;
/// The longest wait for a frame; the cameras deliver several within it.
constexpr std::chrono::milliseconds kFrameWait{50};
constexpr std::int64_t kOpenPeriod_ns = rt::kNsPerSecond;
constexpr std::int64_t kFixturePeriod_ns = rt::kNsPerSecond;
constexpr std::int64_t kFramePeriod_ns = rt::kNsPerSecond / 10;
/// So long a message may be on its way to one subscriber before the others get the next one all the same.
constexpr std::int64_t kLongestWay_ns = rt::kNsPerSecond;
constexpr std::array kTopics{Topic::points, Topic::depth_image, Topic::camera_info, Topic::fixtures};

/// Why hapticd does not share its depth frames, for people; empty: it is not there, of which others speak.
std::string refusalOf(const ClientError& error) {
  if (error.kind == ClientError::Kind::interrupted) return "";
  if (error.kind != ClientError::Kind::error_reply) return error.system_error != 0 ? "" : error.what;
  if (error.what == "org.varlink.service.PermissionDenied") {
    return "no clouds and depth images: the depth image is for root and the groups haptic and haptic-view, "
           "and "
           "hapticd-ros is in neither (as a service: 'sudo systemctl edit hapticd-ros' and the two lines "
           "'[Service]' and 'SupplementaryGroups=haptic-view'; else start it as a member: 'sudo usermod -aG "
           "haptic-view $USER', then log in again)";
  }
  const bool is_explained = fieldAt(error.parameters, "reason") != nullptr;
  return fmt::format("no clouds and depth images: {}",
                     is_explained ? textAt(error.parameters, "reason") : printable(error.what));
}

}  // namespace

base::Result<std::unique_ptr<Scene>> Scene::open(const Participant& participant, SceneOptions options) {
  auto topics = Publications::open(participant, options.name_space, kTopics);
  if (!topics) return std::unexpected(topics.error());
  base::Descriptor ending(::eventfd(0, EFD_CLOEXEC));
  if (!ending)
    return std::unexpected(
        base::Error{"", fmt::format("the system gives no descriptor: {}", std::strerror(errno)), ""});
  return std::unique_ptr<Scene>(new Scene(std::move(*topics), options, std::move(ending)));
}

Scene::Scene(Publications topics, const SceneOptions& options, base::Descriptor ending)
    : topics_(std::move(topics)),
      world_frame_(options.name_space + "/world"),
      optical_frame_(options.name_space + "/camera_optical"),
      ending_(std::move(ending)),
      depth_(options.socket, ending_.get()),
      choice_(options.cloud_rate_hz),
      fixtures_(options.socket, ending_.get()),
      thread_([this] { run(); }) {}

Scene::~Scene() {
  ::eventfd_write(ending_.get(), 1);
  thread_.join();
}

void Scene::run() {
  while (!isEnding()) {
    showFixtures();
    if (wantsDepth()) {
      showDepth();
    } else {
      depth_.close();
      rest();
    }
  }
}

bool Scene::wantsDepth() const {
  return wants(Topic::points) || wants(Topic::depth_image) || wants(Topic::camera_info);
}

void Scene::showDepth() {
  if (!depth_.isOpen()) openDepth();
  if (!depth_.isOpen()) return rest();
  if (!depth_.wait(kFrameWait) || !choice_.takes(rt::monotonicNow_ns())) return;
  if (depth_.read(header_, raw_)) showFrame();
}

void Scene::openDepth() {
  if (rt::monotonicNow_ns() < next_open_ns_) return;
  next_open_ns_ = rt::monotonicNow_ns() + kOpenPeriod_ns;
  const auto opened = depth_.open();
  say(opened ? "" : refusalOf(opened.error()));
}

void Scene::showFrame() {
  view_.set(header_, raw_);
  utc_.measure();
  const trace::ros::Header header{utc_.utc_ns(view_.time_ns()), optical_frame_};
  if (wants(Topic::camera_info))
    show(Topic::camera_info, [&](std::string& to) { encodeCameraInfo(header, view_.camera(), to); });
  if (wants(Topic::depth_image) && mayFollow(Topic::depth_image, image_written_ns_)) {
    view_.millimetres(image_);
    show(Topic::depth_image, [&](std::string& to) { encodeDepthImage(header, image_, to); });
  }
  if (!wants(Topic::points) || !mayFollow(Topic::points, points_written_ns_)) return;
  view_.points(xyz_m_);
  show(Topic::points, [&](std::string& to) { encodePoints(header, xyz_m_, to); });
}

bool Scene::mayFollow(Topic topic, std::int64_t& written_ns) const {
  const std::int64_t now_ns = rt::monotonicNow_ns();
  const bool may =
      topics_.of(topic).isAcknowledged(std::chrono::nanoseconds(0)) || now_ns - written_ns > kLongestWay_ns;
  if (may) written_ns = now_ns;
  return may;
}

void Scene::showFixtures() {
  const std::int64_t now_ns = rt::monotonicNow_ns();
  if (now_ns >= next_fixtures_ns_) {
    next_fixtures_ns_ = now_ns + kFixturePeriod_ns;
    next_frames_ns_ = now_ns + kFramePeriod_ns;
    fixtures_.refresh();
  } else if (now_ns >= next_frames_ns_ && fixtures_.anyMoves() && wants(Topic::fixtures)) {
    next_frames_ns_ = now_ns + kFramePeriod_ns;
    fixtures_.refreshFrames();
  } else {
    return;
  }
  std::vector<Marker> markers = fixtures_.markers();
  if (markers == markers_) return;
  // each message is the whole truth, also for whom a message before it was lost
  std::vector<Marker> all{{.action = Marker::Action::remove_all, .scale_m = {}, .colour = {}}};
  all.insert(all.end(), markers.begin(), markers.end());
  const trace::ros::Header header{rt::realtimeNow_ns(), world_frame_};
  show(Topic::fixtures, [&](std::string& to) { encodeMarkers(header, all, to); });
  markers_ = std::move(markers);
}

/// Says a problem once until it is another one.
void Scene::say(const std::string& problem) {
  if (!problem.empty() && problem != said_) fmt::print(stderr, "hapticd-ros: {}\n", problem);
  said_ = problem;
}

void Scene::noteWrite(bool is_written) {
  if (is_written || std::exchange(write_problem_was_said_, true)) return;
  fmt::print(
      stderr,
      "hapticd-ros: a message of the scene could not be written: a subscriber does not keep up (a lower "
      "--cloud-rate helps)\n");
}

void Scene::rest() const {
  pollfd ending{ending_.get(), POLLIN, 0};
  ::poll(&ending, 1, kRestMs);
}

bool Scene::isEnding() const {
  pollfd ending{ending_.get(), POLLIN, 0};
  return ::poll(&ending, 1, 0) > 0;
}

}  // namespace hapticd::tools::ros
