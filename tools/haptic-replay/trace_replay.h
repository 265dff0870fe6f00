// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "config/settings/settings.h"
#include "config/yaml_loader.h"
#include "daemon/trace/reader/trace_reader.h"
#include "rt/loop/haptic_core.h"
#include "rt/loop/loop_state.h"
#include "tools/haptic-replay/scene_replay.h"
#include "tools/lib/parts/fields.h"

namespace hapticd::tools {

/// The comparison of a trace's ticks with ticks computed again from its depth.
struct TraceComparison {
  std::uint64_t ticks = 0;                                   ///< computed again
  std::array<std::uint64_t, kLeftOutReasons> left_out = {};  ///< not computed, by LeftOut
  std::set<std::uint64_t> missing_frames;  ///< numbers of the frames that are missing for ticks not computed
  std::uint64_t different = 0;             ///< with any difference, in any bit of a force
  std::uint64_t in_contact = 0;            ///< of those computed, in contact
  std::uint64_t models = 0;                ///< built again
  double largest_difference_n = 0;         ///< of the commanded force
  std::uint64_t worst_tick = 0;            ///< where that was; 0: nowhere
  double largest_law_difference_n = 0;
  std::set<std::string> unknown_parameters = {};  ///< of the trace, which this version does not have
};
auto fieldsOf(Is<TraceComparison> auto& comparison) {
  auto& [ticks, left_out, missing, different, in_contact, models, command_n, worst_tick, law_n, unknown] =
      comparison;
  return std::tie(ticks, left_out, missing, different, in_contact, models, command_n, worst_tick, law_n,
                  unknown);
}

/// Computes the ticks of a trace again, from the depth frames that were recorded with it, and compares the
/// forces. The same core runs on the same input at the same times: on the machine that wrote the trace no bit
/// differs. Where an input of a force is missing, ticks are skipped up to the next snapshot of the core's
/// memory from which all inputs are known.
class TraceReplay {
 public:
  /// Errors: the trace cannot be read (as that of a version with other fields), no depth, no snapshot of this
  /// version's core, no settings.
  static base::Result<TraceReplay> open(const std::filesystem::path& trace);

  /// Receives each tick of the trace that was computed again, and the result; may be empty.
  using OnTick = std::function<void(const rt::Tick& recorded, const rt::Tick& computed)>;
  /// Errors: the trace or a frame cannot be read.
  base::Result<TraceComparison> run(const OnTick& on_tick = {});

 private:
  /// The records of the trace to which ticks refer.
  struct Index {
    trace::TraceInfo info;
    std::vector<trace::ModelRecord> models;
    std::map<std::uint64_t, trace::DirectiveRecord> directives;  // by generation
    RecordedAdditions additions;
    config::SolidTable solids;
    std::map<std::uint64_t, rt::FramePose> poses;         // by number
    std::map<std::uint64_t, rt::CoreSnapshot> snapshots;  // by the tick that they were taken before
    std::set<std::int64_t> frames_ns;                     // arrivals of those in the trace
    bool usable = true;                                   // this version's core has that memory
  };
  static base::Result<Index> indexOf(const std::filesystem::path& trace);

  TraceReplay(std::filesystem::path trace, config::RecordedSettings settings, Index index);
  bool takesUp(const rt::Tick& tick);
  /// The poses that the tick was the first to have; nothing if one is not in the trace.
  std::optional<std::vector<rt::FramePose>> posesOf(const rt::Tick& tick) const;
  base::Result<void> replayWaiting(const OnTick& on_tick, bool all);
  base::Result<void> replay(const rt::Tick& tick, const OnTick& on_tick);
  base::Result<void> keepFrame(const trace::DepthRecord& record);
  SceneReplay::ParametersOf parametersOf();
  base::Result<std::optional<rt::Directive>> directiveOf(std::uint64_t generation);
  void leaveOut(LeftOut reason);
  void compare(const rt::Tick& recorded, const rt::Tick& computed);

  std::filesystem::path trace_;
  config::Settings settings_;
  Index index_;
  std::unique_ptr<TraceFrames> frames_;
  std::unique_ptr<SceneReplay> scenes_;
  std::unique_ptr<AdditionsReplay> additions_;
  rt::StartParameters start_;
  std::unique_ptr<rt::HapticCore> core_;
  std::deque<rt::Tick> waiting_;  // for frames that come later in the file
  std::optional<rt::Directive> directive_;
  std::uint64_t last_tick_ = 0;  // computed; 0: none, or a gap since
  TraceComparison comparison_;
};

/// The forces of a trace as CSV, one line per tick that was computed again.
class ForceTable {
 public:
  void add(const rt::Tick& recorded, const rt::Tick& computed);
  std::string text() const;

 private:
  fmt::memory_buffer text_;
};

/// The number of ticks that were not computed again.
std::uint64_t leftOut(const TraceComparison& comparison);

/// What a comparison shows, for people, in lines.
std::string comparisonText(const TraceComparison& comparison);

}  // namespace hapticd::tools
