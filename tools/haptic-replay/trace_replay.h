// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "config/base/error.h"
#include "config/settings/settings.h"
#include "config/yaml_loader.h"
#include "daemon/trace/format/depth_codec.h"
#include "daemon/trace/format/records.h"
#include "daemon/trace/reader/trace_reader.h"
#include "drivers/camera/scene_source.h"
#include "rt/depth/depth_frame.h"
#include "rt/depth/depth_model.h"
#include "rt/fixtures/fixture.h"
#include "rt/loop/haptic_core.h"
#include "rt/loop/loop_state.h"
#include "rt/tissue/tissue.h"
#include "tools/lib/parts/fields.h"

namespace hapticd::tools {

/// The raw depth frames of a trace, from which its scenes were built. They are kept, still compressed, from
/// when they are read to when the ticks have come to them. A frame is known by its arrival, CLOCK_MONOTONIC.
/// Thread: one.
class TraceFrames {
 public:
  enum class State {
    missing,  ///< it was not recorded
    ahead,    ///< it is later in the file than the reading position
    here,
  };

  /// `arrivals_ns`: of all frames that are in the file.
  TraceFrames(std::filesystem::path trace, std::set<std::int64_t> arrivals_ns)
      : trace_(std::move(trace)), arrivals_ns_(std::move(arrivals_ns)) {}

  /// Keeps the frame, and none that arrived before `needed_ns`.
  void add(const trace::DepthRecord& record, std::int64_t needed_ns);
  /// Whether as many are kept as memory permits: half a minute, tens of megabytes where frames compress
  /// well.
  bool full() const { return kept_.size() > kMaxKept; }

  State stateOf(std::int64_t arrival_ns) const;
  /// Only where stateOf() is `here`. Frames that arrived before it are not requested any more.
  base::Result<void> read(std::int64_t arrival_ns, rt::DepthFrame& frame);

 private:
  static constexpr std::size_t kMaxKept = 1024;

  std::filesystem::path trace_;
  std::set<std::int64_t> arrivals_ns_;
  std::map<std::int64_t, trace::DepthRecord> kept_;  ///< by arrival
  std::int64_t newest_read_ns_ = 0;
  trace::DepthDecoder decoder_;
};

/// The fixtures and tissue regions that a trace holds, by generation.
class RecordedAdditions {
 public:
  struct Entry {
    trace::AdditionsRecord record;  ///< without its labels
    std::shared_ptr<const trace::ByteString> labels;
    trace::AdditionsRecord whole() const;
  };

  void add(const trace::AdditionsRecord& record);
  /// Null where the trace does not hold that generation.
  const Entry* ofFixtures(std::uint64_t generation) const;
  const Entry* ofTissue(std::uint64_t generation) const;

 private:
  using Entries = std::map<std::uint64_t, std::shared_ptr<const Entry>>;
  Entries fixtures_;
  Entries tissue_;
  std::shared_ptr<const trace::ByteString> labels_;  ///< of the newest record: most records share them
};

/// Selects the fixtures and tissue regions of each tick of a trace.  Thread: one.
class AdditionsReplay {
 public:
  /// `T_world_camera`: the camera's pose in that session. `name`: of the trace, for messages.
  AdditionsReplay(RecordedAdditions recorded, const rt::PoseParameters& T_world_camera,
                  config::SolidTable solids, std::string name);

  /// Advances to these generations; 0: none. Returns false where the trace does not hold one of them.
  /// Errors: a record that this version cannot read.
  base::Result<bool> goTo(std::uint64_t fixture_generation, std::uint64_t tissue_generation);

  const rt::FixtureSet& fixtures() const { return *fixtures_; }
  const rt::TissueMap& tissue() const { return *tissue_; }

 private:
  RecordedAdditions recorded_;
  rt::PoseParameters T_world_camera_;
  config::SolidTable solids_;
  std::string name_;
  std::unique_ptr<rt::FixtureSet> fixtures_;
  std::unique_ptr<rt::TissueMap> tissue_;
};

/// Why a tick cannot be computed again.
enum class LeftOut {
  start,      ///< the scene is from before the first depth frame that is recorded
  frame,      ///< the depth frame of a force is not recorded
  history,    ///< filter or fusion remember a frame that is not recorded, or a scene that is not in the trace
  model,      ///< the scene is not in the trace
  directive,  ///< the parameters are not in the trace
  additions,  ///< the fixtures or tissue regions are not in the trace
  poses,      ///< a pose of a moving frame is not in the trace
  core,  ///< the core's memory is not known: no snapshot since the beginning, or since ticks left out before
};
inline constexpr std::size_t kLeftOutReasons = 8;

/// Builds the scenes of a trace again, one after the other.
///
/// A scene depends on its frame and, where it is filtered in time or fused, on what the builder remembers of
/// earlier scenes. That memory is known from each restart of the builder on, until a scene cannot be built.
/// Thread: one.
class SceneReplay {
 public:
  /// The parameters of a generation; nothing where the trace does not have them.
  using ParametersOf = std::function<base::Result<std::optional<rt::LiveParameters>>(std::uint64_t)>;

  /// `models`: of the trace, in any order. `frames` outlives the replay.
  SceneReplay(const config::Settings& settings, std::vector<trace::ModelRecord> models, TraceFrames& frames);

  /// Whether all frames needed for that scene have been read or are known to be missing.
  bool ready(std::uint64_t model) const;
  /// Advances to that scene, which then is scene(). Scenes must be requested in ascending order.
  /// Returns why it is not known; nothing: it is.
  /// Errors: a frame that cannot be read, parameters that are none.
  base::Result<std::optional<LeftOut>> goTo(std::uint64_t model, const ParametersOf& parameters_of);

  /// Advances to the next scene, as if a tick had requested it. Does nothing if there is none.
  base::Result<void> goOn(const ParametersOf& parameters_of);
  /// Frames that arrived earlier than this time are not needed any more.
  std::int64_t neededFrom_ns() const;

  const rt::Scene& scene() const { return scene_; }
  std::size_t pointCapacity() const { return source_.builder().pointCapacity(); }
  std::uint64_t built() const { return built_; }
  /// Numbers of the frames that were needed and are missing.
  const std::set<std::uint64_t>& missingFrames() const { return missing_frames_; }

 private:
  base::Result<std::optional<LeftOut>> build(const trace::ModelRecord& record,
                                             const ParametersOf& parameters_of);

  TraceFrames& frames_;
  std::vector<trace::ModelRecord> models_;  // by number, from the first one of a recorded frame on
  drivers::SceneSource source_;
  rt::Scene scene_;
  std::unique_ptr<rt::DepthFrame> frame_;
  std::size_t next_ = 0;            // of models_
  std::uint64_t newest_ = 0;        // number of the newest one reached by goTo(); 0: none
  bool memory_known_ = false;       // of the builder
  std::optional<LeftOut> why_not_;  // of the newest one
  std::uint64_t built_ = 0;
  std::set<std::uint64_t> missing_frames_;
};

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
