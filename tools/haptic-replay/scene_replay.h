// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "config/settings.h"
#include "drivers/camera/scene_source.h"
#include "drivers/trace/records.h"
#include "rt/depth_model.h"
#include "tools/haptic-replay/trace_frames.h"

namespace hapticd::tools {

/// Why a tick cannot be computed again.
enum class LeftOut {
  start,      ///< the scene is from before the first depth frame that is recorded
  frame,      ///< the depth frame of a force is not recorded
  history,    ///< filter or fusion remember a frame that is not recorded, or a scene that is not in the trace
  model,      ///< the scene is not in the trace
  directive,  ///< the parameters are not in the trace
  additions,  ///< the fixtures or tissue regions are not in the trace
  core,  ///< the core's memory is not known: no snapshot since the beginning, or since ticks left out before
};
inline constexpr std::size_t kLeftOutReasons = 7;

/// Builds the scenes of a trace again, one after the other.
///
/// A scene depends on its frame and, where it is filtered in time or fused, on what the builder remembers of
/// earlier scenes. That memory is known from each restart of the builder on, until a scene cannot be built.
/// Thread: one.
class SceneReplay {
 public:
  /// The parameters of a generation; nothing where the trace does not have them.
  using ParametersOf = std::function<config::Result<std::optional<rt::LiveParameters>>(std::uint64_t)>;

  /// `models`: of the trace, in any order. `frames` outlives the replay.
  SceneReplay(const config::Settings& settings, std::vector<drivers::ModelRecord> models,
              TraceFrames& frames);

  /// Whether all frames needed for that scene have been read or are known to be missing.
  bool ready(std::uint64_t model) const;
  /// Advances to that scene, which then is scene(). Scenes must be requested in ascending order.
  /// Returns why it is not known; nothing: it is.
  /// Errors: a frame that cannot be read, parameters that are none.
  config::Result<std::optional<LeftOut>> goTo(std::uint64_t model, const ParametersOf& parameters_of);

  /// Advances to the next scene, as if a tick had requested it. Does nothing if there is none.
  config::Result<void> goOn(const ParametersOf& parameters_of);
  /// Frames that arrived earlier than this time are not needed any more.
  std::int64_t neededFrom_ns() const;

  const rt::Scene& scene() const { return scene_; }
  std::size_t pointCapacity() const { return source_.builder().pointCapacity(); }
  std::uint64_t built() const { return built_; }
  /// Numbers of the frames that were needed and are missing.
  const std::set<std::uint64_t>& missingFrames() const { return missing_frames_; }

 private:
  config::Result<std::optional<LeftOut>> build(const drivers::ModelRecord& record,
                                               const ParametersOf& parameters_of);

  TraceFrames& frames_;
  std::vector<drivers::ModelRecord> models_;  // by number, from the first one of a recorded frame on
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

}  // namespace hapticd::tools
