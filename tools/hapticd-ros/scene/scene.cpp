// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/scene/scene.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>

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
  auto topics = SceneTopics::open(participant, options.name_space);
  if (!topics) return std::unexpected(topics.error());
  base::Descriptor ending(::eventfd(0, EFD_CLOEXEC));
  if (!ending)
    return std::unexpected(
        base::Error{"", fmt::format("the system gives no descriptor: {}", std::strerror(errno)), ""});
  return std::unique_ptr<Scene>(new Scene(std::move(*topics), options, std::move(ending)));
}

Scene::Scene(SceneTopics topics, const SceneOptions& options, base::Descriptor ending)
    : topics_(std::move(topics)),
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
  return topics_.wantsPoints() || topics_.wantsImage() || topics_.wantsCameraInfo();
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
  const std::int64_t time_ns = utc_.utc_ns(view_.time_ns());
  if (topics_.wantsCameraInfo()) noteWrite(topics_.cameraInfo(time_ns, view_.camera()));
  if (topics_.wantsImage() && topics_.mayWriteImage()) {
    view_.millimetres(image_);
    noteWrite(topics_.image(time_ns, image_));
  }
  if (!topics_.wantsPoints() || !topics_.mayWritePoints()) return;
  view_.points(xyz_m_);
  noteWrite(topics_.points(time_ns, xyz_m_));
}

void Scene::showFixtures() {
  const std::int64_t now_ns = rt::monotonicNow_ns();
  if (now_ns >= next_fixtures_ns_) {
    next_fixtures_ns_ = now_ns + kFixturePeriod_ns;
    next_frames_ns_ = now_ns + kFramePeriod_ns;
    fixtures_.refresh();
  } else if (now_ns >= next_frames_ns_ && fixtures_.anyMoves() && topics_.wantsFixtures()) {
    next_frames_ns_ = now_ns + kFramePeriod_ns;
    fixtures_.refreshFrames();
  } else {
    return;
  }
  std::vector<Marker> markers = fixtures_.markers();
  if (markers == markers_) return;
  noteWrite(topics_.fixtures(rt::realtimeNow_ns(), markers));
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
