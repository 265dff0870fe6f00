#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/error.h"
#include "config/settings.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "drivers/trace/trace_reader.h"
#include "rt/depth_model.h"
#include "rt/haptic_core.h"
#include "rt/scene_builder.h"

namespace hapticd::tools {

/// What computing a trace's ticks again has shown.
struct TraceComparison {
  std::uint64_t ticks = 0;          ///< computed again
  std::uint64_t not_covered = 0;    ///< before the first snapshot, or between a gap and the snapshot after it
  std::uint64_t different = 0;      ///< with any difference, in any bit of a force
  std::uint64_t in_contact = 0;     ///< of those computed, with something to feel
  std::uint64_t models = 0;         ///< built again
  double largest_difference_n = 0;  ///< of the commanded force
  std::uint64_t worst_tick = 0;     ///< where that was; 0: nowhere
  double largest_law_difference_n = 0;
};

/// Computes the ticks of a trace again, from the depth frames recorded beside it, and compares the forces.
/// The same core runs on the same input at the same times: on the machine that wrote the trace no bit
/// differs.
class TraceReplay {
 public:
  /// `depth`: the recording's folder.
  /// Errors: trace or recording cannot be read (as that of a version with other fields), no snapshot of this
  /// version's core, no settings.
  static config::Result<TraceReplay> open(const std::filesystem::path& trace,
                                          const std::filesystem::path& depth);

  /// Gets each tick of the trace that was computed again, and what came out; may be empty.
  using OnTick = std::function<void(const rt::Tick& recorded, const rt::Tick& computed)>;
  /// Errors: a frame or scene that the ticks need is missing, the trace cannot be read.
  config::Result<TraceComparison> run(const OnTick& on_tick = {});

 private:
  TraceReplay(std::filesystem::path trace, config::Settings settings, drivers::RecordingReader recording);
  config::Result<void> index();
  bool takesUp(const rt::Tick& tick);
  config::Result<void> modelUpTo(std::uint64_t model);
  config::Result<void> build(const drivers::ModelRecord& record);
  config::Result<rt::Directive> directiveOf(std::uint64_t generation);
  config::Result<void> replay(const rt::Tick& tick, const OnTick& on_tick);
  void compare(const rt::Tick& recorded, const rt::Tick& computed);

  std::filesystem::path trace_;
  config::Settings settings_;
  drivers::RecordingReader recording_;
  std::int64_t realtime_offset_ns_ = 0;
  std::vector<drivers::ModelRecord> models_;
  std::map<std::uint64_t, drivers::DirectiveRecord> directives_;
  std::map<std::uint64_t, rt::CoreSnapshot> snapshots_;  // by the tick that they were taken before
  std::map<std::int64_t, std::size_t> frames_;           // of the recording, by CLOCK_REALTIME

  std::unique_ptr<rt::DepthModel> depth_model_;
  std::unique_ptr<rt::SceneBuilder> builder_;
  std::unique_ptr<rt::SceneStorage> storage_;
  std::unique_ptr<rt::HapticCore> core_;
  std::unique_ptr<rt::DepthFrame> frame_;
  rt::Scene scene_;
  std::size_t next_model_ = 0;  // of models_, to be built next
  std::optional<rt::Directive> directive_;
  std::uint64_t last_tick_ = 0;  // computed; 0: none, or a gap since
  TraceComparison comparison_;
};

}  // namespace hapticd::tools
