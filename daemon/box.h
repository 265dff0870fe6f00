// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "config/error.h"
#include "config/parameter_table.h"
#include "drivers/camera/camera.h"
#include "drivers/handle/handle.h"
#include "drivers/led/led_panel.h"
#include "drivers/trace/trace_folder.h"
#include "rt/depth_frame.h"
#include "rt/latency_histogram.h"
#include "rt/loop_state.h"

namespace hapticd::daemon {

/// Counters of the scene thread.
struct SceneStatus {
  std::uint64_t frames = 0;    ///< taken over from the camera
  std::uint64_t models = 0;    ///< scenes built, remodelled ones included
  std::uint64_t remodels = 0;  ///< scenes built again because the HIP left the modelled ball
  std::uint32_t points = 0;    ///< in the newest scene
  std::uint64_t points_over_capacity = 0;
  std::uint64_t skipped_frames = 0;  ///< frames that a newer one replaced before they were modelled
  std::int64_t last_model_ns = 0;    ///< time it took to build the newest scene
  double frame_rate_hz = 0;
};

using rt::LatencySummary;
using rt::summaryOf;

/// Force and contact over the ticks since the last summary.
struct WindowSummary {
  std::uint64_t ticks = 0;
  std::uint64_t contact_ticks = 0;
  double min_force_n = 0;
  double max_force_n = 0;  ///< largest magnitude commanded
  std::int64_t max_wakeup_latency_ns = 0;
};

/// Which force law is in use, and why.
struct LawStatus {
  rt::ForceLaw law = rt::ForceLaw::nearest_springs;
  std::string reason;           ///< one sentence
  bool filtered = false;        ///< depth passes a filter
  double expected_error_n = 0;  ///< measured for this law, filter and distance; 0: not known
  double max_error_n = 0;       ///< that the law auto may make
  double distance_m = 0;        ///< of what is felt, from the camera; 0: not known
  /// k_s times motion and force scale, as far as the handle's delay allows: what the hand feels.
  double hand_stiffness_n_per_m = 0;
};

/// How an LED shines; isLit() (indicators.h) has the times.
enum class LedPattern { off, on, slow_blink, fast_blink, double_blink };

/// The pattern of each LED; the index is the value of its drivers::Led.
using LedPatterns = std::array<LedPattern, drivers::kLedCount>;

struct IndicatorStatus {
  drivers::LedStatus panel;
  LedPatterns patterns{};  ///< of the LEDs that are configured, the others show nothing
};

enum class TraceState {
  off,      ///< no trace is wanted
  writing,  ///< ticks go into a file
  waiting,  ///< a trace is wanted, but cannot be written now; it goes on by itself, in another file
};

/// What was done with a trace without anybody having asked for it.
struct TraceNews {
  std::uint64_t number = 0;  ///< 1, 2, ...
  bool warning = false;      ///< something was lost by it
  std::string action;        ///< one word
  std::string trace;         ///< its name
  std::string text;          ///< with the name and the reason
};

/// What is written of the force loop's ticks.
struct TraceStatus {
  TraceState state = TraceState::off;
  std::string detail;  ///< why it waits, and what to do; may be empty
  /// What failed beside it (a dump, the recovery, a deletion) or is about to happen (a full folder, a disk
  /// that stalls); with what to do.
  std::vector<std::string> problems;
  std::string name;                         ///< of the trace being written; empty: none
  std::uint64_t ticks = 0;                  ///< in it
  std::uint64_t bytes = 0;                  ///< of it, on the disk
  double duration_s = 0;                    ///< since its begin
  std::uint64_t ticks_lost = 0;             ///< since the start, while a trace was wanted: not in any file
  std::uint64_t records_lost = 0;           ///< models and events that there was no room for, since the start
  std::uint64_t depth_frames = 0;           ///< in it
  std::uint64_t depth_frames_lost = 0;      ///< since the start: not recorded, because the disk was too slow
  std::uint64_t traces = 0;                 ///< finished since the start
  std::uint64_t deleted = 0;                ///< by trace.max_folder_mb, since the start
  std::uint64_t recovered = 0;              ///< left open by a crash and finished at the start
  std::uint64_t dumps = 0;                  ///< of the flight recorder, since the start
  std::string last_dump;                    ///< name of the newest one; empty: none
  double flight_recorder_s = 0;             ///< of ticks that it holds now
  std::uint64_t folder_bytes = 0;           ///< of all traces
  std::optional<std::uint64_t> free_bytes;  ///< on their disk; nothing: not known
  std::optional<std::uint64_t> limit_bytes;  ///< that they may take, trace.max_folder_mb; nothing: no limit
  std::string next_deleted;                  ///< name of the trace that goes next at the limit; empty: none
  std::vector<TraceNews> news;               ///< the newest, the oldest of them first
};

/// What a trace is to be.
struct TraceRequest {
  std::string label;  ///< behind the time in its name; may be empty
  bool depth = false;
};

/// What the camera sees and where the HIP is, at one moment.
struct SceneSnapshot {
  std::unique_ptr<rt::DepthFrame> frame;
  rt::DepthModelParameters depth_model;
  rt::PoseParameters T_world_camera;
  rt::Tick tick;  ///< the newest one
};

/// How the thread that serves the control API does.
struct ControlStatus {
  /// Between two of its periods, since the start; the service manager's watchdog waits at most that long.
  std::int64_t longest_gap_ns = 0;
  std::uint64_t ticks_lost = 0;  ///< since the start: the thread came too late for them
  std::uint64_t connections = 0;
  std::uint64_t refused_connections = 0;  ///< since the start: there were too many
};

/// Everything that the outside may know of the box at one moment.
struct BoxStatus {
  rt::LoopState loop;
  rt::LoopPrivileges privileges;
  std::vector<std::string> warnings;  ///< what is not as it should be, each with its remedy
  double rate_hz = 0;                 ///< ticks per second over the last second
  LatencySummary wakeup_latency;
  LatencySummary compute_time;
  std::uint64_t trace_ticks_dropped = 0;  ///< ticks that did not fit into the ring
  /// Pages that the force thread had to wait for since its first tick; nothing: not known.
  std::optional<std::uint64_t> force_thread_page_faults;
  drivers::CameraStatus camera;
  SceneStatus scene;
  drivers::HandleStatus handle;
  double uptime_s = 0;
  LawStatus law;
  IndicatorStatus leds;
  TraceStatus trace;
  ControlStatus control;
};

/// The running box as the control API sees it.
/// Thread: control thread only.
class Box {
 public:
  virtual ~Box() = default;
  virtual BoxStatus status() = 0;
  /// The parameters as they are set now; restart-only ones as they were at start.
  virtual const config::Settings& settings() const = 0;
  /// Hands the changed live parameters to the force loop. Returns the generation to wait for.
  virtual std::uint64_t apply(const config::Settings& settings) = 0;
  /// Requests `engaged` or `idle`. `inside`: also where something is felt at once. To ask again for what is
  /// engaged or held changes nothing. Returns the generation to wait for.
  virtual std::uint64_t engage(bool engaged, bool inside) = 0;
  /// The newest generation that the force loop has taken over.
  virtual std::uint64_t acknowledgedGeneration() = 0;

  // What takes as long as the disk or the camera takes. Each begins at once and returns; the future gets the
  // outcome. Starting, stopping and dumping follow each other in the order of the calls; they, lists and
  // deletions do not wait for one another.

  /// Begins a trace; its name. Errors: one is being written, the folder cannot be written, no space.
  virtual std::future<config::Result<std::string>> startTrace(const TraceRequest& request) = 0;
  /// Finishes the trace; its name. Errors: none is being written.
  virtual std::future<config::Result<std::string>> stopTrace() = 0;
  /// Writes out what the flight recorder holds; the trace's name. Errors: it is switched off or empty, the
  /// folder cannot be written, no space.
  virtual std::future<config::Result<std::string>> dumpTrace() = 0;
  virtual std::future<config::Result<std::vector<drivers::TraceEntry>>> listTraces() = 0;
  virtual std::future<config::Result<void>> deleteTrace(const std::string& name) = 0;
  /// Marks a trace to be kept, or takes the mark away. Errors: no such trace, the disk's.
  virtual std::future<config::Result<void>> keepTrace(const std::string& name, bool keep) = 0;
  /// Notes a line of text about a trace; an empty text removes the note.
  virtual std::future<config::Result<void>> noteTrace(const std::string& name, const std::string& text) = 0;
  /// The newest frame. Errors: there is none yet.
  virtual std::future<config::Result<SceneSnapshot>> takeSnapshot() = 0;
};

}  // namespace hapticd::daemon
