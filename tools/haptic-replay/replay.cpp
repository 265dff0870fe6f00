// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-replay/replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "config/base/value_text.h"
#include "config/settings/law_choice.h"
#include "drivers/camera/recorded/depth_image.h"
#include "rt/loop/haptic_core.h"
#include "rt/scene/scene.h"
#include "tools/lib/registration/point_files.h"

namespace hapticd::tools {
namespace {

constexpr const char* kHeader = "t_s,x_m,y_m,z_m";
constexpr double kMax_s = 1e9;  // nanoseconds of it fit into 64 bits

}  // namespace

std::expected<std::vector<HipSample>, std::vector<base::Error>> readHipCsv(
    const std::filesystem::path& file) {
  PointTable table(file, kHeader, "check --hip");
  std::vector<HipSample> samples;
  table.readInto([&](const PointTable::Fields& fields) {
    const auto metres = [&](std::size_t column) {
      return table.number(column, fields, -rt::kWorkspaceHalfEdge_m, rt::kWorkspaceHalfEdge_m, "m");
    };
    const double time_s = table.number(0, fields, 0, kMax_s, "s");
    samples.push_back({time_s, {metres(1), metres(2), metres(3)}});
  });
  if (!table.errors().empty()) return std::unexpected(std::move(table.errors()));
  return samples;
}

base::Result<DepthSource> DepthSource::open(const std::filesystem::path& path,
                                            const drivers::DepthLimits& limits) {
  DepthSource source;
  std::error_code no_file;
  if (!std::filesystem::exists(path, no_file)) {
    return base::failure(path.string(), "no such file or folder",
                         "--depth takes the folder of a recording or one .pgm file");
  }
  if (!std::filesystem::is_directory(path, no_file)) {
    source.image_ = path;
    return source;
  }
  auto recording = drivers::RecordingReader::open(path, limits);
  if (!recording) return std::unexpected(recording.error());
  source.recording_ = std::move(*recording);
  return source;
}

std::size_t DepthSource::frameAt(std::int64_t time_ns) const {
  if (!recording_) return 0;
  const auto& frames = recording_->frames();
  const auto after = std::upper_bound(
      frames.begin(), frames.end(), time_ns,
      [](std::int64_t time, const drivers::RecordedFrame& frame) { return time < frame.host_ns; });
  return static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - frames.begin() - 1, 0));
}

base::Result<void> DepthSource::read(std::size_t index, rt::DepthFrame& frame) const {
  if (recording_) return recording_->read(index, frame);
  frame.sequence = 1;
  frame.arrival_ns = 0;
  frame.device_ticks = 0;
  return drivers::readKinectImage(image_, frame);
}

namespace {

/// Returns the settings with the camera that the depth is of.
config::Settings settingsFor(const config::Settings& settings, const DepthSource& source) {
  config::Settings own = settings;
  if (const auto camera = source.camera()) {
    own.camera.driver = "recorded";
    own.camera.stated_model = *camera;
  }
  return own;
}

}  // namespace

std::optional<base::Error> wholeFrameProblem(const config::Settings& settings, const DepthSource& source) {
  constexpr std::size_t kMaxWords = std::size_t{1} << 21;  // of 64 voxels each: 25 MB with their ranks
  constexpr double kMaxUnits = rt::PackedPixel::kRawRange - 1;
  const config::CameraSettings camera = settingsFor(settings, source).camera;
  const rt::DepthModel model(camera.effectiveDepthModel(), camera.pose());
  const auto& [near_m, far_m, unit_m] =
      std::tie(model.parameters().near_m, model.parameters().far_m, model.parameters().unit_m);
  if (model.isLinear() && far_m - near_m >= kMaxUnits * unit_m) {
    return base::Error{
        "--full-model",
        fmt::format("a scene of the whole frame holds {:.4g} m of depth in units of {:.4g} um, "
                    "but from camera.near_m to camera.far_m it is {} m",
                    kMaxUnits * unit_m, unit_m * 1e6, base::numberText(far_m - near_m)),
        "move camera.near_m and camera.far_m together, or leave out --full-model"};
  }
  if (rt::GridShape::of(settings.grid, model).words() <= kMaxWords) return std::nullopt;
  return base::Error{
      "--full-model",
      fmt::format("the camera's whole view up to camera.far_m, {} m, takes more memory than is "
                  "reserved for its voxels of {} m",
                  base::numberText(far_m), base::numberText(settings.grid.frame_voxel_edge_m)),
      "lower camera.far_m, or leave out --full-model"};
}

Replay::Replay(const config::Settings& settings, const DepthSource& source, Stage stage,
               double handle_delay_s, const config::LabelImage& labels, config::SolidTable solids)
    : settings_(settingsFor(settings, source)),
      source_(source),
      stage_(stage),
      box_(settings_.camera.effectiveDepthModel(), settings.camera.pose(), settings.grid),
      velocity_(settings.handle.resolution_m * settings.handle.motion_scale),
      handle_delay_s_(handle_delay_s),
      frame_(std::make_unique<rt::DepthFrame>()),
      spare_(std::make_unique<rt::DepthFrame>()),
      solids_(std::move(solids)),
      fixtures_(std::make_unique<rt::FixtureSet>()),
      tissue_(std::make_unique<rt::TissueMap>()) {
  settings_.live = settings_.effectiveLive();
  // The ramp is for a person's comfort; a replay begins engaged.
  settings_.live.safety.engage_ramp_s = 0;
  box_.parameters() = settings_.live;
  box_.start() = settings_.startParameters();
  box_.setLoopPeriod(1 / settings_.loop.rate_hz);
  config::toFixtureSet(
      settings.additions.fixtures, {},
      {settings.camera.pose(), settings.additions.frames, solids_, settings.live.tool.radius_m}, *fixtures_);
  config::toTissueMap(settings.additions.regions, {}, labels, settings.camera.pose(), *tissue_);
  box_.setAdditions(fixtures_.get(), tissue_.get());
}

/// Leaves the frame that is shown as it is if this one cannot be read.
bool Replay::readOne(std::size_t index) {
  if (damaged_.contains(index)) return false;
  if (const auto read = source_.read(index, *spare_); !read) {
    damaged_.emplace(index, read.error());
    return false;
  }
  std::swap(frame_, spare_);
  return true;
}

/// Reads a frame, or the nearest readable one; returns its index.
base::Result<std::size_t> Replay::readFrame(std::size_t index) {
  for (std::size_t before = index + 1; before-- > 0;) {
    if ((frame_taken_ && before == frame_index_) || readOne(before)) return before;
  }
  for (std::size_t behind = index + 1; behind < source_.frames(); ++behind) {
    if (readOne(behind)) return behind;
  }
  const base::Error& first = damaged_.begin()->second;
  if (source_.frames() == 1) return std::unexpected(first);
  return std::unexpected(
      base::Error{"depth", fmt::format("none of the {} frames can be read", source_.frames()), first.text()});
}

base::Result<void> Replay::takeFrame(std::int64_t time_ns) {
  const std::size_t wanted = source_.frameAt(time_ns);
  if (!frame_taken_ || wanted != wanted_index_) {
    const auto read = readFrame(wanted);
    if (!read) return std::unexpected(read.error());
    wanted_index_ = wanted;
    if (!frame_taken_ || *read != frame_index_) showFrame(*read, time_ns);
  }
  box_.setTime(time_ns);
  return {};
}

void Replay::showFrame(std::size_t index, std::int64_t time_ns) {
  frame_index_ = index;
  frame_taken_ = true;
  depth_use_.add(drivers::DepthUse::of(*frame_, box_.depthModel()));
  if (source_.isImage()) {
    box_.show(*frame_);
  } else {
    box_.show(*frame_, time_ns);
  }
}

std::vector<std::string> Replay::depthProblems() const {
  std::vector<std::string> problems;
  if (!damaged_.empty()) {
    problems.push_back(fmt::format("{} of {} frames cannot be read and were skipped, the first: {}",
                                   damaged_.size(), source_.frames(), damaged_.begin()->second.text()));
  }
  if (!source_.cutOff().empty())
    problems.push_back("the last line of the index was left out: " + source_.cutOff());
  if (std::string advice = depth_use_.all(); !advice.empty()) problems.push_back(std::move(advice));
  return problems;
}

/// Chooses the law for `auto` by the distance of the first HIP, for the whole replay.
void Replay::decideLaw(const rt::Vec3& hip_m_in_world) {
  if (law_decided_) return;
  law_decided_ = true;
  const double distance_m = -box_.depthModel().positionInCamera(hip_m_in_world).z;
  if (settings_.live.force.law || !(distance_m > 0)) return;
  const config::SurfaceAsSeen seen = config::asSeenBy(box_.depthModel().parameters(), distance_m);
  box_.parameters() = config::liveWith(settings_, config::chooseLaw(settings_, seen));
}

base::Result<ReplayedForce> Replay::feel(const HipSample& sample) {
  decideLaw(sample.hip_m_in_world);
  const std::int64_t time_ns = std::llround(sample.time_s * 1e9);
  if (auto taken = takeFrame(time_ns); !taken) return std::unexpected(taken.error());
  if (stage_ == Stage::law) {
    const rt::ForceSample force = box_.lawForce(sample.hip_m_in_world);
    return ReplayedForce{force.force_n_in_world, force.points_used, frame_index_};
  }
  const rt::Tick tick = command(sample, time_ns);
  return ReplayedForce{tick.command_force_n_in_world, tick.points_used, frame_index_};
}

rt::Tick Replay::command(const HipSample& sample, std::int64_t time_ns) {
  const double period_s = last_time_s_ ? sample.time_s - *last_time_s_ : 1 / settings_.loop.rate_hz;
  last_time_s_ = sample.time_s;
  const rt::Vec3 velocity = velocity_.add(sample.hip_m_in_world, time_ns);
  return box_.tick(sample.hip_m_in_world, period_s, velocity, handle_delay_s_);
}

}  // namespace hapticd::tools
