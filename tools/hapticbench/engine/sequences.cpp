// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/engine/sequences.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "drivers/camera/kinect_image.h"
#include "drivers/camera/recorded/camera_description.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "drivers/camera/synthetic/analytic_scene.h"

namespace hapticd::tools {
namespace {

namespace fs = std::filesystem;

bool unpack(const fs::path& archive, const fs::path& folder) {
  std::string program = "tar", mode = "xJf", file = archive.string(), change = "-C", to = folder.string();
  char* arguments[] = {program.data(), mode.data(), file.data(), change.data(), to.data(), nullptr};
  pid_t child = 0;
  int status = 0;
  return posix_spawnp(&child, "tar", nullptr, nullptr, arguments, environ) == 0 &&
         waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

/// Returns the first file below `folder` that `matches` accepts.
template <typename Matches>
std::optional<fs::path> findFile(const fs::path& folder, Matches matches) {
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() && matches(entry.path())) return entry.path();
  }
  return std::nullopt;
}

/// Returns the limits that the camera of a recording states, or the usual ones.
base::Result<drivers::DepthLimits> limitsOf(const fs::path& recording) {
  drivers::DepthLimits limits;
  const fs::path file = recording / drivers::kCameraFile;
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return limits;
  const auto description = drivers::readCameraDescription(file);
  if (!description) return std::unexpected(description.error());
  limits.near_m = description->near_m.value_or(limits.near_m);
  limits.far_m = description->far_m.value_or(limits.far_m);
  return limits;
}

base::Result<BenchSequence> firstFrames(const std::string& name, const fs::path& recording,
                                        std::size_t most_frames) {
  const auto limits = limitsOf(recording);
  if (!limits) return std::unexpected(limits.error());
  const auto reader = drivers::RecordingReader::open(recording, *limits);
  if (!reader) return std::unexpected(reader.error());
  BenchSequence sequence{name, {}};
  for (std::size_t i = 0; i < std::min(most_frames, reader->frames().size()); ++i) {
    sequence.frames.push_back(std::make_unique<rt::DepthFrame>());
    if (auto read = reader->read(i, *sequence.frames.back()); !read) return std::unexpected(read.error());
  }
  return sequence;
}

/// Returns the recording in `folder`, without frames if there is none.
base::Result<BenchSequence> sequenceIn(const fs::path& folder, std::size_t most_frames) {
  const auto isIndex = [](const fs::path& file) {
    return file.filename() == "INDEX.txt" || file.filename() == drivers::kCameraFile;
  };
  const auto isArchive = [](const fs::path& file) { return file.string().ends_with(".tar.xz"); };
  const std::string name = folder.filename().string();
  if (const auto index = findFile(folder, isIndex))
    return firstFrames(name, index->parent_path(), most_frames);
  const auto archive = findFile(folder, isArchive);
  if (!archive) return BenchSequence{name, {}};
  const TemporaryFolder unpacked;
  if (unpacked.path().empty() || !unpack(*archive, unpacked.path())) {
    return std::unexpected(base::Error{archive->string(), "cannot be unpacked", "is xz-utils installed?"});
  }
  const auto index = findFile(unpacked.path(), isIndex);
  return index ? firstFrames(name, index->parent_path(), most_frames) : BenchSequence{name, {}};
}

}  // namespace

BenchSequence syntheticScene() {
  drivers::SyntheticSettings table;
  table.scene = drivers::SyntheticScene::plane;
  table.noise = drivers::SyntheticNoise::quantised;
  table.distance_m = 1.05;
  table.tilt_rad = -0.65;
  drivers::SyntheticSettings ball = table;
  ball.scene = drivers::SyntheticScene::sphere;
  ball.distance_m = 0.95;
  ball.sphere_radius_m = 0.12;
  BenchSequence scene{"synthetic", {}};
  rt::DepthFrame& frame = *scene.frames.emplace_back(std::make_unique<rt::DepthFrame>());
  const auto in_front = std::make_unique<rt::DepthFrame>();
  drivers::AnalyticScene(table, {}).render(0, frame);
  drivers::AnalyticScene(ball, {}).render(0, *in_front);
  // the nearer surface has the smaller disparity; 2047 means no measurement
  for (std::size_t i = 0; i < drivers::kKinectPixels; ++i) {
    frame.raw[i] = std::min(frame.raw[i], in_front->raw[i]);
  }
  frame.sequence = 1;
  return scene;
}

base::Result<std::vector<BenchSequence>> recordedSequences(const fs::path& folder, std::size_t most_frames) {
  std::vector<BenchSequence> sequences;
  std::error_code no_folder;
  if (!fs::is_directory(folder, no_folder)) return sequences;
  std::vector<fs::path> subfolders;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_directory()) subfolders.push_back(entry.path());
  }
  std::ranges::sort(subfolders);
  for (const fs::path& subfolder : subfolders) {
    auto sequence = sequenceIn(subfolder, most_frames);
    if (!sequence) return std::unexpected(sequence.error());
    if (!sequence->frames.empty()) sequences.push_back(std::move(*sequence));
  }
  return sequences;
}

namespace {

constexpr double kDeviceTicksPerTick = 60000;  // 60 MHz, of a Kinect
constexpr double kTick_ns = 1e6;
constexpr long kUsualPeriod = 33;
constexpr long kMaxPeriod = 500;  // longer ones are a recording that was interrupted

/// Ticks from one frame of the session to the next.
long ticksBetween(const rt::DepthFrame& frame, const rt::DepthFrame& next, bool is_kinect) {
  if (!is_kinect) return std::lround(static_cast<double>(next.arrival_ns - frame.arrival_ns) / kTick_ns);
  // in 32 bits, so that a counter that wraps around goes on
  const std::uint32_t passed = next.device_ticks - frame.device_ticks;
  return std::lround(passed / kDeviceTicksPerTick);
}

}  // namespace

std::vector<long> arrivalTicks(const BenchSequence& session) {
  std::vector<long> ticks{0};
  for (std::size_t i = 1; i < session.frames.size(); ++i) {
    const long period = ticksBetween(*session.frames[i - 1], *session.frames[i], isKinect(session.camera()));
    ticks.push_back(ticks.back() + (period >= 1 && period <= kMaxPeriod ? period : kUsualPeriod));
  }
  return ticks;
}

PlayedSession::PlayedSession(const BenchSequence& session, int first)
    : session_(session), first_(first), arrival_ticks_(arrivalTicks(session)) {
  for (auto& buffer : shown_) buffer = std::make_unique<rt::DepthFrame>();
}

int PlayedSession::frameOfSession(int index) const {
  const int last = static_cast<int>(session_.frames.size()) - 1;
  const int place = (first_ + index) % (2 * last);
  return place <= last ? place : 2 * last - place;
}

long PlayedSession::arrivalTick(int index) const {
  const int last = static_cast<int>(session_.frames.size()) - 1;
  const auto since = [this, last](int played) {
    const long turns = played / (2 * last);
    const int place = played % (2 * last);
    const long once = arrival_ticks_.back();
    const long within = place <= last ? arrival_ticks_[static_cast<std::size_t>(place)]
                                      : 2 * once - arrival_ticks_[static_cast<std::size_t>(2 * last - place)];
    return turns * 2 * once + within;
  };
  return since(first_ + index) - since(first_);
}

const rt::DepthFrame& PlayedSession::frame(int index) {
  rt::DepthFrame& shown = *shown_[static_cast<std::size_t>(index % kBuffers)];
  shown = *session_.frames[static_cast<std::size_t>(frameOfSession(index))];
  shown.sequence = static_cast<std::uint64_t>(index) + 1;
  shown.arrival_ns = arrivalTick(index) * 1'000'000;
  return shown;
}

FrameStream PlayedSession::stream() {
  return {[this](int index) -> const rt::DepthFrame& { return frame(index); },
          [this](int index) { return arrivalTick(index); }};
}

}  // namespace hapticd::tools
