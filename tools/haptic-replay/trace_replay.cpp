#include "tools/haptic-replay/trace_replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "config/parameter_table.h"
#include "config/yaml_loader.h"

namespace hapticd::tools {
namespace {

constexpr const char* kSettingsAttachment = "settings.yaml";
constexpr const char* kOtherVersion = "is of another version of hapticd, whose core may compute otherwise";
constexpr const char* kSameVersion =
    "take haptic-replay of the version that wrote it; hapticctl trace info says which";

std::unexpected<config::Error> refuse(const std::filesystem::path& where, std::string what,
                                      std::string remedy) {
  return std::unexpected(config::Error{where.string(), std::move(what), std::move(remedy)});
}

config::Result<config::Settings> settingsOf(const std::filesystem::path& trace,
                                            const drivers::TraceInfo& info) {
  const auto found =
      std::ranges::find(info.attachments, kSettingsAttachment, &drivers::TraceAttachment::name);
  if (found == info.attachments.end()) {
    return refuse(trace, "has no settings attached", "replay a trace that hapticd has written");
  }
  auto settings =
      config::settingsFromText(found->data, fmt::format("{} in {}", kSettingsAttachment, trace.string()));
  if (!settings) return std::unexpected(settings.error().front());
  return *settings;
}

bool sameBits(const rt::Vec3& a, const rt::Vec3& b) {
  const auto bits = [](double number) { return std::bit_cast<std::uint64_t>(number); };
  return bits(a.x) == bits(b.x) && bits(a.y) == bits(b.y) && bits(a.z) == bits(b.z);
}

}  // namespace

config::Result<TraceReplay> TraceReplay::open(const std::filesystem::path& trace,
                                              const std::filesystem::path& depth) {
  auto recording = drivers::RecordingReader::open(depth);
  if (!recording) return std::unexpected(recording.error());
  const auto info = drivers::readTrace(trace);
  if (!info) return std::unexpected(info.error());
  if (!info->missing.empty()) return refuse(trace, kOtherVersion, kSameVersion);
  const auto settings = settingsOf(trace, *info);
  if (!settings) return std::unexpected(settings.error());
  TraceReplay replay(trace, *settings, std::move(*recording));
  replay.realtime_offset_ns_ = info->realtime_offset_ns;
  if (auto indexed = replay.index(); !indexed) return std::unexpected(indexed.error());
  return replay;
}

TraceReplay::TraceReplay(std::filesystem::path trace, config::Settings settings,
                         drivers::RecordingReader recording)
    : trace_(std::move(trace)),
      settings_(std::move(settings)),
      recording_(std::move(recording)),
      depth_model_(
          std::make_unique<rt::DepthModel>(settings_.camera.effectiveDepthModel(), settings_.camera.pose)),
      builder_(std::make_unique<rt::SceneBuilder>(*depth_model_, settings_.grid)),
      storage_(std::make_unique<rt::SceneStorage>(builder_->shape(), builder_->pointCapacity())),
      core_(std::make_unique<rt::HapticCore>(builder_->pointCapacity())),
      frame_(std::make_unique<rt::DepthFrame>()) {
  storage_->attachTo(scene_);
}

/// What the ticks refer to, and the frames by their time.
config::Result<void> TraceReplay::index() {
  bool usable = true;
  drivers::TraceVisitor visitor;
  visitor.model = [this](const drivers::ModelRecord& model) { return models_.push_back(model), true; };
  visitor.directive = [this](const drivers::DirectiveRecord& directive) {
    directives_[directive.generation] = directive;
    return true;
  };
  visitor.snapshot = [this, &usable](const drivers::SnapshotRecord& record) {
    usable = usable && record.usable;
    snapshots_.emplace(record.snapshot.tick, record.snapshot);
    return true;
  };
  if (const auto read = drivers::readTrace(trace_, visitor); !read) return std::unexpected(read.error());
  if (!usable) return refuse(trace_, kOtherVersion, kSameVersion);
  if (snapshots_.empty()) {
    return refuse(trace_, "holds no snapshot of the core, so its ticks cannot be computed again",
                  "write it with depth: hapticctl trace start --depth");
  }
  std::ranges::sort(models_, {}, &drivers::ModelRecord::model);
  const auto& frames = recording_.frames();
  for (std::size_t i = 0; i < frames.size(); ++i) frames_.emplace(frames[i].realtime_ns, i);
  // What was built before filter and fusion began anew depends on frames that were not recorded.
  const auto first = std::ranges::find_if(
      models_, [](const drivers::ModelRecord& model) { return model.forgot && model.depth_recorded; });
  next_model_ = static_cast<std::size_t>(first - models_.begin());
  return {};
}

/// Whether the tick can be computed: it follows the one before, or a snapshot was taken before it.
bool TraceReplay::takesUp(const rt::Tick& tick) {
  if (last_tick_ != 0 && tick.number == last_tick_ + 1) return true;
  const auto snapshot = snapshots_.find(tick.number);
  if (snapshot == snapshots_.end()) {
    last_tick_ = 0;
    return false;
  }
  core_->restore(snapshot->second.memory);
  return true;
}

config::Result<void> TraceReplay::build(const drivers::ModelRecord& record) {
  const auto found = frames_.find(record.frame_time_ns + realtime_offset_ns_);
  if (!record.depth_recorded || found == frames_.end()) {
    return refuse(recording_.folder(),
                  fmt::format("frame {} of scene {} is not in it", record.frame, record.model),
                  "the disk was too slow while it was recorded; ticks up to there can be replayed");
  }
  if (auto read = recording_.read(found->second, *frame_); !read) return read;
  frame_->sequence = record.frame;
  frame_->arrival_ns = record.frame_time_ns;
  const auto directive = directiveOf(record.generation);
  if (!directive) return std::unexpected(directive.error());
  if (record.forgot) builder_->forget();
  builder_->build(*frame_, record.centre_m_in_world, record.radius_m, scene_,
                  rt::SceneNeeds::of(directive->parameters));
  scene_.model = record.model;
  ++comparison_.models;
  return {};
}

/// Each scene in its turn: what a filter remembers depends on those before.
config::Result<void> TraceReplay::modelUpTo(std::uint64_t model) {
  while (next_model_ < models_.size() && models_[next_model_].model <= model) {
    if (auto built = build(models_[next_model_]); !built) return built;
    ++next_model_;
  }
  if (scene_.model == model) return {};
  return refuse(trace_, fmt::format("scene {} is not in it", model),
                "records were lost while it was written");
}

config::Result<rt::Directive> TraceReplay::directiveOf(std::uint64_t generation) {
  if (directive_ && directive_->generation == generation) return *directive_;
  const auto found = directives_.find(generation);
  if (found == directives_.end()) {
    return refuse(trace_, fmt::format("parameter set {} is not in it", generation),
                  "records were lost while it was written");
  }
  const drivers::DirectiveRecord& record = found->second;
  config::Settings settings = settings_;
  for (const auto& [name, value] : record.parameters) {
    if (auto set = config::setFromText(settings, name + "=" + value); !set)
      return std::unexpected(set.error());
  }
  directive_ = rt::Directive{.generation = record.generation,
                             .engage = record.engage,
                             .engage_inside = record.engage_inside,
                             .engage_request = record.engage_request,
                             .parameters = settings.effectiveLive()};
  return *directive_;
}

config::Result<void> TraceReplay::replay(const rt::Tick& tick, const OnTick& on_tick) {
  if (!takesUp(tick)) {
    ++comparison_.not_covered;
    return {};
  }
  if (auto modelled = modelUpTo(tick.scene_model); !modelled) return modelled;
  auto directive = directiveOf(tick.directive_generation);
  if (!directive) return std::unexpected(directive.error());
  if (tick.stopping) directive->engage = false;
  const std::int64_t woke_ns = tick.planned_ns + tick.wakeup_latency_ns;
  const rt::Tick computed = core_->step({woke_ns, 1 / settings_.loop.rate_hz, scene_, tick.handle, *directive,
                                         tick.after_overrun, tick.stopping && tick.released});
  compare(tick, computed);
  if (on_tick) on_tick(tick, computed);
  last_tick_ = tick.number;
  return {};
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

config::Result<TraceComparison> TraceReplay::run(const OnTick& on_tick) {
  config::Result<void> replayed;
  drivers::TraceVisitor visitor;
  visitor.tick = [&](const rt::Tick& tick) {
    replayed = replay(tick, on_tick);
    return replayed.has_value();
  };
  const auto read = drivers::readTrace(trace_, visitor);
  if (!replayed) return std::unexpected(replayed.error());
  if (!read) return std::unexpected(read.error());
  return comparison_;
}

}  // namespace hapticd::tools
