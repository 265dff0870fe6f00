// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-replay/scene_replay.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "daemon/trace/format/additions.h"

namespace hapticd::tools {

void TraceFrames::add(const trace::DepthRecord& record, std::int64_t needed_ns) {
  kept_.erase(kept_.begin(), kept_.lower_bound(needed_ns));
  if (record.header.arrival_ns >= needed_ns) kept_.insert_or_assign(record.header.arrival_ns, record);
}

TraceFrames::State TraceFrames::stateOf(std::int64_t arrival_ns) const {
  if (kept_.contains(arrival_ns)) return State::here;
  return arrivals_ns_.contains(arrival_ns) && arrival_ns > newest_read_ns_ ? State::ahead : State::missing;
}

base::Result<void> TraceFrames::read(std::int64_t arrival_ns, rt::DepthFrame& frame) {
  kept_.erase(kept_.begin(), kept_.lower_bound(arrival_ns));
  newest_read_ns_ = arrival_ns;
  const std::string wrong = decoder_.decode(kept_.at(arrival_ns), frame);
  if (wrong.empty()) return {};
  return std::unexpected(base::Error{trace_.string(), wrong, "hapticctl trace info checks the whole file"});
}

trace::AdditionsRecord RecordedAdditions::Entry::whole() const {
  trace::AdditionsRecord copy = record;
  copy.labels = *labels;
  return copy;
}

void RecordedAdditions::add(const trace::AdditionsRecord& record) {
  if (!labels_ || labels_->bytes != record.labels.bytes) {
    labels_ = std::make_shared<const trace::ByteString>(record.labels);
  }
  Entry entry{record, labels_};
  entry.record.labels = {};
  const auto shared = std::make_shared<const Entry>(std::move(entry));
  fixtures_[record.fixture_generation] = shared;
  tissue_[record.tissue_generation] = shared;
}

const RecordedAdditions::Entry* RecordedAdditions::ofFixtures(std::uint64_t generation) const {
  const auto found = fixtures_.find(generation);
  return found == fixtures_.end() ? nullptr : found->second.get();
}

const RecordedAdditions::Entry* RecordedAdditions::ofTissue(std::uint64_t generation) const {
  const auto found = tissue_.find(generation);
  return found == tissue_.end() ? nullptr : found->second.get();
}

AdditionsReplay::AdditionsReplay(RecordedAdditions recorded, const rt::PoseParameters& T_world_camera,
                                 config::SolidTable solids, std::string name)
    : recorded_(std::move(recorded)),
      T_world_camera_(T_world_camera),
      solids_(std::move(solids)),
      name_(std::move(name)),
      fixtures_(std::make_unique<rt::FixtureSet>()),
      tissue_(std::make_unique<rt::TissueMap>()) {}

base::Result<bool> AdditionsReplay::goTo(std::uint64_t fixture_generation, std::uint64_t tissue_generation) {
  if (fixture_generation != fixtures_->generation) {
    const auto* const entry = recorded_.ofFixtures(fixture_generation);
    if (entry == nullptr) return false;
    const auto restored = trace::restore(entry->record, T_world_camera_, name_, solids_, *fixtures_);
    if (!restored) return std::unexpected(restored.error());
  }
  if (tissue_generation != tissue_->generation) {
    const auto* const entry = recorded_.ofTissue(tissue_generation);
    if (entry == nullptr) return false;
    const auto restored = trace::restore(entry->whole(), T_world_camera_, name_, *tissue_);
    if (!restored) return std::unexpected(restored.error());
  }
  return true;
}

namespace {

/// Whether a scene depends on those before it.
bool remembers(const rt::SceneNeeds& needs) {
  const bool filtered_in_time = needs.filter.temporal_frames > 1 || needs.filter.hold_frames > 0;
  return filtered_in_time || needs.visible_surface || needs.hidden;
}

}  // namespace

SceneReplay::SceneReplay(const config::Settings& settings, std::vector<trace::ModelRecord> models,
                         TraceFrames& frames)
    : frames_(frames),
      models_(std::move(models)),
      source_(settings.camera.effectiveDepthModel(), settings.camera.pose(), settings.grid),
      frame_(std::make_unique<rt::DepthFrame>()) {
  frame_->camera = settings.camera.effectiveDepthModel();
  source_.attach(scene_);
  std::ranges::sort(models_, {}, &trace::ModelRecord::model);
  models_.erase(models_.begin(), std::ranges::find_if(models_, &trace::ModelRecord::depth_recorded));
}

bool SceneReplay::ready(std::uint64_t model) const {
  for (std::size_t i = next_; i < models_.size() && models_[i].model <= model; ++i) {
    if (frames_.stateOf(models_[i].frame_time_ns) == TraceFrames::State::ahead) return false;
  }
  return true;
}

base::Result<std::optional<LeftOut>> SceneReplay::goTo(std::uint64_t model,
                                                       const ParametersOf& parameters_of) {
  for (; next_ < models_.size() && models_[next_].model <= model; ++next_) {
    const trace::ModelRecord& record = models_[next_];
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

base::Result<void> SceneReplay::goOn(const ParametersOf& parameters_of) {
  if (next_ == models_.size()) return {};
  const auto reached = goTo(models_[next_].model, parameters_of);
  return reached ? base::Result<void>{} : std::unexpected(reached.error());
}

std::int64_t SceneReplay::neededFrom_ns() const {
  return next_ < models_.size() ? models_[next_].frame_time_ns : std::numeric_limits<std::int64_t>::max();
}

base::Result<std::optional<LeftOut>> SceneReplay::build(const trace::ModelRecord& record,
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
    return std::unexpected(base::Error{"depth", "a frame is of a camera that cannot be modelled",
                                       "see the camera of the trace"});
  }
  source_.attach(scene_);
  source_.builder().build(*frame_, record.centre_m_in_world, record.radius_m, scene_, needs);
  scene_.model = record.model;
  ++built_;
  return std::nullopt;
}

}  // namespace hapticd::tools
