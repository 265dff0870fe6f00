// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-replay/scene_replay.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace hapticd::tools {
namespace {

/// Whether a scene depends on those before it.
bool remembers(const rt::SceneNeeds& needs) {
  const bool filtered_in_time = needs.filter.temporal_frames > 1 || needs.filter.hold_frames > 0;
  return filtered_in_time || needs.visible_surface || needs.hidden;
}

}  // namespace

SceneReplay::SceneReplay(const config::Settings& settings, std::vector<drivers::ModelRecord> models,
                         TraceFrames& frames)
    : frames_(frames),
      models_(std::move(models)),
      source_(settings.camera.effectiveDepthModel(), settings.camera.pose, settings.grid),
      frame_(std::make_unique<rt::DepthFrame>()) {
  frame_->camera = settings.camera.effectiveDepthModel();
  source_.attach(scene_);
  std::ranges::sort(models_, {}, &drivers::ModelRecord::model);
  models_.erase(models_.begin(), std::ranges::find_if(models_, &drivers::ModelRecord::depth_recorded));
}

bool SceneReplay::ready(std::uint64_t model) const {
  for (std::size_t i = next_; i < models_.size() && models_[i].model <= model; ++i) {
    if (frames_.stateOf(models_[i].frame_time_ns) == TraceFrames::State::ahead) return false;
  }
  return true;
}

config::Result<std::optional<LeftOut>> SceneReplay::goTo(std::uint64_t model,
                                                         const ParametersOf& parameters_of) {
  for (; next_ < models_.size() && models_[next_].model <= model; ++next_) {
    const drivers::ModelRecord& record = models_[next_];
    if (record.model != newest_ + 1) memory_known_ = false;
    newest_ = record.model;
    auto built = build(record, parameters_of);
    if (!built) return built;
    why_not_ = *built;
    if (why_not_) memory_known_ = false;
  }
  if (models_.empty() || model < models_.front().model) return LeftOut::start;
  if (newest_ != model) return LeftOut::model;
  return why_not_;
}

config::Result<void> SceneReplay::goOn(const ParametersOf& parameters_of) {
  if (next_ == models_.size()) return {};
  const auto reached = goTo(models_[next_].model, parameters_of);
  return reached ? config::Result<void>{} : std::unexpected(reached.error());
}

std::int64_t SceneReplay::neededFrom_ns() const {
  return next_ < models_.size() ? models_[next_].frame_time_ns : std::numeric_limits<std::int64_t>::max();
}

config::Result<std::optional<LeftOut>> SceneReplay::build(const drivers::ModelRecord& record,
                                                          const ParametersOf& parameters_of) {
  if (record.forgot) {
    source_.builder().forget();
    memory_known_ = true;
  }
  const bool recorded =
      record.depth_recorded && frames_.stateOf(record.frame_time_ns) == TraceFrames::State::here;
  if (!recorded) {
    missing_frames_.insert(record.frame);
    return LeftOut::frame;
  }
  const auto parameters = parameters_of(record.generation);
  if (!parameters) return std::unexpected(parameters.error());
  if (!*parameters) return LeftOut::directive;
  const rt::SceneNeeds needs = rt::SceneNeeds::of(**parameters);
  if (remembers(needs) && !memory_known_) return LeftOut::history;
  if (auto read = frames_.read(record.frame_time_ns, *frame_); !read) return std::unexpected(read.error());
  frame_->sequence = record.frame;
  if (!source_.follow(frame_->camera)) {
    return std::unexpected(config::Error{"depth", "a frame is of a camera that cannot be modelled",
                                         "see the camera of the trace"});
  }
  source_.attach(scene_);
  source_.builder().build(*frame_, record.centre_m_in_world, record.radius_m, scene_, needs);
  scene_.model = record.model;
  ++built_;
  return std::nullopt;
}

}  // namespace hapticd::tools
