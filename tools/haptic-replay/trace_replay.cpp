// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-replay/trace_replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <set>
#include <utility>

#include "config/settings/parameter_table.h"
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
  return base::failure(trace_.string(), wrong, "hapticctl trace info checks the whole file");
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
    return base::failure("depth", "a frame is of a camera that cannot be modelled",
                         "see the camera of the trace");
  }
  source_.attach(scene_);
  source_.builder().build(*frame_, record.centre_m_in_world, record.radius_m, scene_, needs);
  scene_.model = record.model;
  ++built_;
  return std::nullopt;
}

namespace {

/// The ticks of a minute.
constexpr std::size_t kMaxWaitingTicks = 60'000;
constexpr const char* kSettingsAttachment = "settings.yaml";
constexpr const char* kOtherVersion = "is of another version of hapticd, whose core may compute otherwise";
constexpr const char* kSameVersion =
    "take haptic-replay of the version that wrote it; hapticctl trace info shows which";

base::Result<config::RecordedSettings> settingsOf(const std::filesystem::path& trace,
                                                  const trace::TraceInfo& info) {
  const auto found = std::ranges::find(info.attachments, kSettingsAttachment, &trace::TraceAttachment::name);
  if (found == info.attachments.end()) {
    return base::failure(trace, "has no settings attached", "replay a trace that hapticd has written");
  }
  auto settings =
      config::recordedSettings(found->data, fmt::format("{} in {}", kSettingsAttachment, trace.string()));
  if (!settings) return std::unexpected(settings.error().front());
  return *settings;
}

bool sameBits(const rt::Vec3& a, const rt::Vec3& b) {
  const auto bits = [](double number) { return std::bit_cast<std::uint64_t>(number); };
  return bits(a.x) == bits(b.x) && bits(a.y) == bits(b.y) && bits(a.z) == bits(b.z);
}

}  // namespace

base::Result<TraceReplay> TraceReplay::open(const std::filesystem::path& trace) {
  auto index = indexOf(trace);
  if (!index) return std::unexpected(index.error());
  auto settings = settingsOf(trace, index->info);
  if (!settings) return std::unexpected(settings.error());
  return TraceReplay(trace, std::move(*settings), std::move(*index));
}

base::Result<TraceReplay::Index> TraceReplay::indexOf(const std::filesystem::path& trace) {
  Index index;
  trace::TraceVisitor visitor;
  visitor.model = [&index](const trace::ModelRecord& model) { return index.models.push_back(model), true; };
  visitor.directive = [&index](const trace::DirectiveRecord& directive) {
    index.directives[directive.generation] = directive;
    return true;
  };
  visitor.additions = [&index](const trace::AdditionsRecord& additions) {
    index.additions.add(additions);
    return true;
  };
  visitor.pose = [&index](const trace::PoseRecord& pose) {
    index.poses[pose.number] = trace::poseOf(pose);
    return true;
  };
  visitor.snapshot = [&index](const trace::SnapshotRecord& record) {
    index.usable = record.usable;
    if (record.usable) index.snapshots.emplace(record.snapshot.tick, record.snapshot);
    return record.usable;
  };
  visitor.depth = [&index](const trace::DepthRecord& record) {
    index.frames_ns.insert(record.header.arrival_ns);
    return true;
  };
  auto info = trace::readTrace(trace, visitor);
  if (!info) return std::unexpected(info.error());
  index.info = std::move(*info);
  auto solids = trace::solidsIn(index.info.attachments, trace.string());
  if (!solids) return std::unexpected(solids.error());
  index.solids = std::move(*solids);
  if (!index.info.missing.empty() || !index.usable) return base::failure(trace, kOtherVersion, kSameVersion);
  if (index.snapshots.empty() || index.frames_ns.empty()) {
    const char* const what = index.frames_ns.empty() ? "depth" : "snapshot of the core";
    return base::failure(trace, fmt::format("holds no {}, so its ticks cannot be computed again", what),
                         "write it with depth: hapticctl trace start --depth");
  }
  return index;
}

TraceReplay::TraceReplay(std::filesystem::path trace, config::RecordedSettings settings, Index index)
    : trace_(std::move(trace)),
      settings_(std::move(settings.settings)),
      index_(std::move(index)),
      frames_(std::make_unique<TraceFrames>(trace_, std::move(index_.frames_ns))),
      scenes_(std::make_unique<SceneReplay>(settings_, std::move(index_.models), *frames_)),
      additions_(std::make_unique<AdditionsReplay>(std::move(index_.additions), settings_.camera.pose(),
                                                   std::move(index_.solids), trace_.string())),
      start_(settings_.startParameters()),
      core_(std::make_unique<rt::HapticCore>(scenes_->pointCapacity())) {
  comparison_.unknown_parameters.insert(settings.unknown.begin(), settings.unknown.end());
}

/// Whether the core's memory is known: the tick follows the one before, or a snapshot was taken before it.
bool TraceReplay::takesUp(const rt::Tick& tick) {
  if (last_tick_ != 0 && tick.number == last_tick_ + 1) return true;
  const auto snapshot = index_.snapshots.find(tick.number);
  if (snapshot == index_.snapshots.end()) return false;
  core_->restore(snapshot->second.memory);
  return true;
}

std::optional<std::vector<rt::FramePose>> TraceReplay::posesOf(const rt::Tick& tick) const {
  std::vector<rt::FramePose> poses;
  for (std::uint64_t number = core_->newestPose() + 1; number <= tick.frame_pose; ++number) {
    const auto pose = index_.poses.find(number);
    if (pose == index_.poses.end()) return std::nullopt;
    poses.push_back(pose->second);
  }
  return poses;
}

base::Result<std::optional<rt::Directive>> TraceReplay::directiveOf(std::uint64_t generation) {
  if (directive_ && directive_->generation == generation) return directive_;
  const auto found = index_.directives.find(generation);
  if (found == index_.directives.end()) return std::nullopt;
  const trace::DirectiveRecord& record = found->second;
  config::Settings settings = settings_;
  for (const auto& [name, value] : record.parameters) {
    if (config::findParameter(name) == nullptr) {
      comparison_.unknown_parameters.insert(name);
      continue;
    }
    if (auto set = config::setFromText(settings, name + "=" + value); !set)
      return std::unexpected(set.error());
  }
  directive_ = rt::Directive{.generation = record.generation,
                             .engage = record.engage,
                             .engage_inside = record.engage_inside,
                             .engage_request = record.engage_request,
                             .parameters = settings.effectiveLive()};
  directive_->parameters.standoff_clearance_m = record.standoff_clearance_m;
  return directive_;
}

SceneReplay::ParametersOf TraceReplay::parametersOf() {
  return [this](std::uint64_t generation) -> base::Result<std::optional<rt::LiveParameters>> {
    const auto directive = directiveOf(generation);
    if (!directive) return std::unexpected(directive.error());
    return *directive ? std::optional((*directive)->parameters) : std::nullopt;
  };
}

/// Keeps a frame for the scenes. During a long time without ticks, scenes are built without computing forces,
/// so that their frames need not be kept.
base::Result<void> TraceReplay::keepFrame(const trace::DepthRecord& record) {
  frames_->add(record, scenes_->neededFrom_ns());
  if (!frames_->full()) return {};
  return scenes_->goOn(parametersOf());
}

/// Frames may be a little later in the file than the ticks that used them.
base::Result<void> TraceReplay::replayWaiting(const OnTick& on_tick, bool all) {
  while (!waiting_.empty() && (all || scenes_->ready(waiting_.front().scene_model))) {
    if (auto replayed = replay(waiting_.front(), on_tick); !replayed) return replayed;
    waiting_.pop_front();
  }
  if (waiting_.size() <= kMaxWaitingTicks) return {};
  return base::failure(
      trace_, fmt::format("has more than {} ticks before the depth frame that they used", kMaxWaitingTicks),
      "replay the trace as hapticd wrote it");
}

base::Result<void> TraceReplay::replay(const rt::Tick& tick, const OnTick& on_tick) {
  // also where the tick is left out: later scenes may remember this one
  const auto why_not = scenes_->goTo(tick.scene_model, parametersOf());
  if (!why_not) return std::unexpected(why_not.error());
  auto directive = directiveOf(tick.directive_generation);
  if (!directive) return std::unexpected(directive.error());
  if (*why_not) return leaveOut(**why_not), base::Result<void>{};
  if (!*directive) return leaveOut(LeftOut::directive), base::Result<void>{};
  const auto additions = additions_->goTo(tick.fixture_generation, tick.tissue_generation);
  if (!additions) return std::unexpected(additions.error());
  if (!*additions) return leaveOut(LeftOut::additions), base::Result<void>{};
  if (!takesUp(tick)) return leaveOut(LeftOut::core), base::Result<void>{};
  const auto poses = posesOf(tick);
  if (!poses) return leaveOut(LeftOut::poses), base::Result<void>{};
  if (tick.stopping) (*directive)->engage = false;
  const std::int64_t woke_ns = tick.planned_ns + tick.wakeup_latency_ns;
  const rt::Tick computed = core_->step({.now_ns = woke_ns,
                                         .period_s = 1 / settings_.loop.rate_hz,
                                         .scene = scenes_->scene(),
                                         .handle = tick.handle,
                                         .directive = **directive,
                                         .start = start_,
                                         .overran = tick.after_overrun,
                                         .release = tick.stopping && tick.released,
                                         .fixtures = &additions_->fixtures(),
                                         .tissue = &additions_->tissue(),
                                         .poses = *poses,
                                         .external_n_in_world = tick.external_force_n_in_world});
  compare(tick, computed);
  if (on_tick) on_tick(tick, computed);
  last_tick_ = tick.number;
  return {};
}

void TraceReplay::leaveOut(LeftOut reason) {
  ++comparison_.left_out[static_cast<std::size_t>(reason)];
  last_tick_ = 0;
}

void TraceReplay::compare(const rt::Tick& recorded, const rt::Tick& computed) {
  ++comparison_.ticks;
  if (rt::inContact(recorded)) ++comparison_.in_contact;
  const bool same = sameBits(recorded.law_force_n_in_world, computed.law_force_n_in_world) &&
                    sameBits(recorded.command_force_n_in_world, computed.command_force_n_in_world) &&
                    recorded.mode == computed.mode && recorded.cause == computed.cause;
  if (same) return;
  ++comparison_.different;
  const auto distance = [](const rt::Vec3& a, const rt::Vec3& b) { return rt::norm(a - b); };
  const double command_n = distance(recorded.command_force_n_in_world, computed.command_force_n_in_world);
  const double law_n = distance(recorded.law_force_n_in_world, computed.law_force_n_in_world);
  comparison_.largest_law_difference_n = std::max(comparison_.largest_law_difference_n, law_n);
  if (comparison_.worst_tick != 0 && command_n <= comparison_.largest_difference_n) return;
  comparison_.largest_difference_n = command_n;
  comparison_.worst_tick = recorded.number;
}

base::Result<TraceComparison> TraceReplay::run(const OnTick& on_tick) {
  base::Result<void> replayed;
  trace::TraceVisitor visitor;
  visitor.tick = [&](const rt::Tick& tick) {
    waiting_.push_back(tick);
    replayed = replayWaiting(on_tick, false);
    return replayed.has_value();
  };
  visitor.depth = [&](const trace::DepthRecord& record) {
    replayed = keepFrame(record);
    if (replayed) replayed = replayWaiting(on_tick, false);
    return replayed.has_value();
  };
  const auto read = trace::readTrace(trace_, visitor);
  if (read && replayed) replayed = replayWaiting(on_tick, true);
  if (!replayed) return std::unexpected(replayed.error());
  if (!read) return std::unexpected(read.error());
  comparison_.models = scenes_->built();
  comparison_.missing_frames = scenes_->missingFrames();
  return comparison_;
}

namespace {

/// "3..5, 9, ...": at most so many stretches.
std::string stretchesOf(const std::set<std::uint64_t>& numbers) {
  constexpr int kMaxStretches = 20;
  std::string text;
  int stretches = 0;
  for (auto number = numbers.begin(); number != numbers.end();) {
    if (++stretches > kMaxStretches) return text + ", ...";
    const std::uint64_t first = *number;
    std::uint64_t last = first;
    while (++number != numbers.end() && *number == last + 1) ++last;
    text += text.empty() ? "" : ", ";
    text += first == last ? fmt::format("{}", first) : fmt::format("{}..{}", first, last);
  }
  return text;
}

std::string leftOutText(const TraceComparison& comparison) {
  constexpr std::array<const char*, kLeftOutReasons> kReasons{
      "before the first recorded depth frame",
      "their depth frame is not recorded",
      "filter or fusion remember what is not recorded",
      "their scene is not in the trace",
      "their parameters are not in the trace",
      "their fixtures or tissue regions are not in the trace",
      "poses of moving frames are not in the trace",
      "before the first snapshot of the core, or the next one after a gap"};
  std::string text;
  for (std::size_t reason = 0; reason < kLeftOutReasons; ++reason) {
    if (comparison.left_out[reason] == 0) continue;
    text += fmt::format("left out {} ticks: {}\n", comparison.left_out[reason], kReasons[reason]);
  }
  if (!comparison.missing_frames.empty()) {
    text += fmt::format("depth frames that are not recorded: {} ({})\n", comparison.missing_frames.size(),
                        stretchesOf(comparison.missing_frames));
  }
  return text;
}

std::string unknownText(const std::set<std::string>& parameters) {
  if (parameters.empty()) return "";
  return fmt::format("left out parameters that this version does not have: {}\n",
                     fmt::join(parameters, ", "));
}

}  // namespace

void ForceTable::add(const rt::Tick& recorded, const rt::Tick& computed) {
  const rt::Vec3& was = recorded.command_force_n_in_world;
  const rt::Vec3& is = computed.command_force_n_in_world;
  fmt::format_to(std::back_inserter(text_), "{},{:.9f},{},{},{},{},{},{},{}\n", recorded.number,
                 static_cast<double>(recorded.planned_ns) * 1e-9, was.x, was.y, was.z, is.x, is.y, is.z,
                 rt::norm(is - was));
}

std::string ForceTable::text() const {
  return "tick,t_s,recorded_fx_n,recorded_fy_n,recorded_fz_n,fx_n,fy_n,fz_n,difference_n\n" +
         fmt::to_string(text_);
}

std::uint64_t leftOut(const TraceComparison& comparison) {
  return std::accumulate(comparison.left_out.begin(), comparison.left_out.end(), std::uint64_t{0});
}

std::string comparisonText(const TraceComparison& comparison) {
  const std::string where =
      comparison.worst_tick == 0 ? "" : fmt::format(" at tick {}", comparison.worst_tick);
  return fmt::format(
      "{} ticks computed again ({} in contact, {} scenes modelled), {} left out\n"
      "{}{}different: {} ticks\n"
      "largest difference: {:g} N of the commanded force{}, {:g} N of the law's\n",
      comparison.ticks, comparison.in_contact, comparison.models, leftOut(comparison),
      leftOutText(comparison), unknownText(comparison.unknown_parameters), comparison.different,
      comparison.largest_difference_n, where, comparison.largest_law_difference_n);
}

}  // namespace hapticd::tools
