// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <future>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "config/base/error.h"
#include "config/settings/fixture_settings.h"
#include "config/settings/parameter_table.h"
#include "daemon/base/reloads.h"
#include "drivers/camera/camera.h"
#include "drivers/handle/handle.h"
#include "drivers/led/led_panel.h"
#include "drivers/trace/trace_folder.h"
#include "drivers/trace/trace_format.h"
#include "rt/base/latency_histogram.h"
#include "rt/base/vec3.h"
#include "rt/base/words.h"
#include "rt/depth/depth_frame.h"
#include "rt/loop/loop_state.h"

namespace hapticd::daemon {

struct Ball {
  rt::Vec3 centre_m;
  double radius_m = 0;
};

/// Counters of the scene thread.
struct SceneStatus {
  std::uint64_t frames = 0;    ///< frames received from the camera
  std::uint64_t models = 0;    ///< scenes built, including those built again
  std::uint64_t remodels = 0;  ///< scenes built again because the HIP left the modelled ball
  std::uint32_t points = 0;    ///< number of points in the newest scene
  std::uint64_t points_over_capacity = 0;
  std::uint64_t skipped_frames = 0;  ///< frames that a newer one replaced before they were modelled
  std::int64_t last_model_ns = 0;    ///< time it took to build the newest scene
  double frame_rate_hz = 0;
  /// The ball of space that is modelled, in the world frame; nothing: no model yet, or the whole frame is.
  std::optional<Ball> ball;
};

using rt::LatencySummary;
using rt::summaryOf;

/// Summary of force and contact over the ticks since the previous summary.
struct WindowSummary {
  std::uint64_t ticks = 0;
  std::uint64_t contact_ticks = 0;
  double min_force_n = 0;
  double max_force_n = 0;  ///< largest magnitude commanded
  std::int64_t max_wakeup_latency_ns = 0;
};

/// The force law in use, and the reason for it.
struct LawStatus {
  rt::ForceLaw law = rt::ForceLaw::nearest_springs;
  std::string reason;           ///< one sentence
  bool filtered = false;        ///< the law works on filtered depth
  double expected_error_n = 0;  ///< measured RMS error of this law and filter at this distance; 0: not known
  double max_error_n = 0;       ///< largest RMS error that force.law auto accepts
  double distance_m = 0;        ///< from the camera to the proxy; 0: not known
  /// Stiffness at the hand: k_s times motion and force scale, reduced as far as the handle's delay demands.
  double hand_stiffness_n_per_m = 0;
};

/// What one virtual fixture does.
struct FixtureConduct {
  std::string name{};
  double configured_n_per_m = 0;  ///< its stiffness, as it is configured
  double stiffness_n_per_m = 0;   ///< in effect; 0: it does not act
  double force_n = 0;             ///< exerted on the hand, before handle.force_scale
  /// Of the HIP from its boundary, negative inside a forbidden region, or from path or point; not a number:
  /// not known.
  double distance_m = std::numeric_limits<double>::quiet_NaN();
  rt::Breach breach{};  ///< the newest that has ended
};

/// The virtual fixtures, as people see them.
struct FixtureStatus {
  std::uint64_t generation = 0;         ///< of the set of fixtures
  std::uint64_t count = 0;              ///< all of them
  std::uint64_t enabled = 0;            ///< those that are enabled
  std::vector<std::string> in_contact;  ///< names of those that exert a force
  std::string nearest;                  ///< name of the nearest forbidden region; empty: none, or not known
  /// From the HIP to its boundary, negative inside the forbidden region; infinite: none, or not known.
  double distance_m = std::numeric_limits<double>::infinity();
  bool warning = false;              ///< distance_m is below proximity.warning_m
  double force_n = 0;                ///< magnitude of the force that all forbidden regions exert
  double guidance_force_n = 0;       ///< magnitude of the force that all guidance fixtures exert
  std::vector<FixtureConduct> each;  ///< empty: the force loop has not taken over this set yet
};

/// Counters of the measured stiffness that estimators feed.
struct FeedStatus {
  std::uint64_t accepted = 0;  ///< samples
  std::uint64_t limited = 0;   ///< samples refused because they came too fast
  std::uint64_t outside = 0;   ///< samples refused because no region contains their position
};

/// The tissue regions, as people see them.
struct TissueStatus {
  std::uint64_t generation = 0;  ///< of the list of regions
  std::uint64_t count = 0;       ///< of regions
  std::string in_contact;        ///< name of the region with the largest share of the contact; empty: none
  FeedStatus feed;
};

/// How an LED blinks; isLit() (indicators.h) defines the times.
enum class LedPattern { off, on, slow_blink, fast_blink, double_blink };
constexpr auto wordsOf(LedPattern) {
  return rt::words<LedPattern>("off", "on", "slow_blink", "fast_blink", "double_blink");
}

/// The pattern of each LED; the index is the value of its drivers::Led.
using LedPatterns = std::array<LedPattern, drivers::kLedCount>;

struct IndicatorStatus {
  drivers::LedStatus panel;
  LedPatterns patterns{};  ///< only those of configured LEDs have a meaning
};

using drivers::TraceState;

/// Something that the box did with a trace without a request.
struct TraceNews {
  std::uint64_t number = 0;  ///< 1 for the first since the start
  bool warning = false;      ///< something was lost
  std::string action;        ///< one word, such as "delete"
  std::string trace;         ///< its name
  std::string text;          ///< a sentence with the name and the reason
};

/// The state of tracing: what is recorded, what was lost, and how much space is left.
struct TraceStatus {
  TraceState state = TraceState::off;
  std::string detail;  ///< the reason for waiting, and the remedy; may be empty
  /// What failed apart from the recording itself (a dump, the recovery, a deletion) or is about to fail (a
  /// full folder, a disk that stalls), each with its remedy.
  std::vector<std::string> problems;
  std::string name;                     ///< name of the trace being written; empty: none
  std::uint64_t ticks = 0;              ///< ticks in it
  std::uint64_t bytes = 0;              ///< its size on the disk
  double duration_s = 0;                ///< since it was started
  std::uint64_t ticks_lost = 0;         ///< since the start: in no file although a trace was requested
  std::uint64_t records_lost = 0;       ///< models and events dropped for lack of space, since the start
  std::uint64_t depth_frames = 0;       ///< depth frames in it
  std::uint64_t depth_frames_lost = 0;  ///< since the start: not recorded, because the disk was too slow
  std::uint64_t traces = 0;             ///< traces finished since the start
  std::uint64_t deleted = 0;            ///< traces deleted because of trace.max_folder_mb, since the start
  std::uint64_t recovered = 0;          ///< traces left open by a crash and finished at the start
  std::uint64_t dumps = 0;              ///< dumps of the flight recorder since the start
  std::string last_dump;                ///< name of the newest dump; empty: none
  double flight_recorder_s = 0;         ///< duration of the ticks in the flight recorder
  std::uint64_t folder_bytes = 0;       ///< size of all traces
  std::optional<std::uint64_t> free_bytes;   ///< free space on their disk; nothing: not known
  std::optional<std::uint64_t> limit_bytes;  ///< trace.max_folder_mb; nothing: no limit
  std::string next_deleted;     ///< name of the next trace to be deleted at the limit; empty: none
  std::vector<TraceNews> news;  ///< the most recent, oldest first
};

/// How a trace is to be recorded.
struct TraceRequest {
  std::string label;  ///< follows the time in the name of the trace; may be empty
  bool depth = false;
};

/// The camera's image and the state of the force loop at one moment.
struct SceneSnapshot {
  std::unique_ptr<rt::DepthFrame> frame;
  rt::DepthModelParameters depth_model;
  rt::PoseParameters T_world_camera;
  rt::Tick tick;  ///< the newest tick
};

/// Memory that holds the newest depth frames (drivers/depth_region).
struct SharedDepth {
  int descriptor = -1;  ///< of the memory file; stays the box's
  std::size_t bytes = 0;
};

/// Statistics of the thread that serves the control API.
struct ControlStatus {
  /// Longest time between two of its periods since the start; the watchdog of the service manager has never
  /// waited longer.
  std::int64_t longest_gap_ns = 0;
  std::uint64_t ticks_lost = 0;  ///< since the start, because the thread was too slow
  std::uint64_t connections = 0;
  std::uint64_t refused_connections = 0;  ///< since the start, because there were too many
  /// Entries of the log that nothing took: they are in no journal and on no terminal. Since the start.
  std::uint64_t log_entries_lost = 0;
  std::uint64_t notifications_lost = 0;  ///< to the service manager, because it did not take them
};

/// The whole status of the box at one moment, as clients see it.
struct BoxStatus {
  rt::LoopState loop;
  rt::LoopPrivileges privileges;
  std::vector<std::string> warnings;  ///< what is wrong with the box, each with its remedy
  double rate_hz = 0;                 ///< ticks per second over the last second
  LatencySummary wakeup_latency;
  LatencySummary compute_time;
  std::uint64_t trace_ticks_dropped = 0;  ///< ticks for which the ring to the trace thread had no room
  /// Page faults of the force thread since its first tick; nothing: not known.
  std::optional<std::uint64_t> force_thread_page_faults;
  drivers::CameraStatus camera;
  SceneStatus scene;
  drivers::HandleStatus handle;
  double uptime_s = 0;
  LawStatus law;
  IndicatorStatus leds;
  TraceStatus trace;
  ControlStatus control;
  FixtureStatus fixtures;
  TissueStatus tissue;
  std::optional<PendingReload> pending_reload;  ///< nothing: none waits
};

/// Counts the changes of the fixtures and of the tissue regions.
struct AdditionGenerations {
  std::uint64_t fixtures = 0;
  std::uint64_t regions = 0;  ///< without changes of their stiffness by setMeasuredStiffness()
};

/// What estimators have measured of a region.
struct MeasuredStiffness {
  std::size_t region = 0;  ///< place in Box::additions().regions
  double stiffness_n_per_m = 0;
  double damping_n_s_per_m = 0;
};

/// The running box as the control API uses it.
/// Thread: control thread only.
class Box {
 public:
  virtual ~Box() = default;
  virtual BoxStatus status() = 0;
  /// The current parameters; those that only a restart changes have their values from the start.
  virtual const config::Settings& settings() const = 0;
  /// Hands the changed live parameters, fixtures and regions to the force loop. Returns the generation to
  /// wait for.
  virtual std::uint64_t apply(const config::Settings& settings) = 0;
  /// The fixtures and tissue regions in use.
  virtual const config::SceneAdditions& additions() const = 0;
  virtual AdditionGenerations additionGenerations() const = 0;
  /// Hands checked fixtures and regions to the force loop, which replace all others. Returns the generation
  /// to wait for.
  virtual std::uint64_t applyAdditions(const config::SceneAdditions& additions) = 0;
  /// The region of additions() that covers a position, as an index; nothing: none does.
  virtual std::optional<std::size_t> regionAt(const rt::Vec3& position_m_in_world) const = 0;
  /// Gives regions of additions() another stiffness and damping, each within its range. Nobody waits for it.
  virtual void setMeasuredStiffness(const std::vector<MeasuredStiffness>& measured) = 0;
  /// Requests `engaged` or `idle`. `inside`: even if the HIP is inside a surface. A request to engage changes
  /// nothing while the box is engaged or holding. Returns the generation to wait for.
  virtual std::uint64_t engage(bool engaged, bool inside) = 0;
  /// Whether a force may act: the box is engaged or holding, or is about to be.
  virtual bool engaged() = 0;
  /// The newest generation that the force loop has taken over.
  virtual std::uint64_t acknowledgedGeneration() = 0;

  // The following functions take as long as the disk or the camera does: each starts its work and returns at
  // once, and the future receives the outcome. Starting, stopping and dumping are done in the order of the
  // calls. Lists and deletions neither wait for these nor for each other.

  /// Starts a trace and returns its name. Errors: one is being written, the folder cannot be written, no
  /// space.
  virtual std::future<base::Result<std::string>> startTrace(const TraceRequest& request) = 0;
  /// Finishes the trace and returns its name. Errors: none is being written.
  virtual std::future<base::Result<std::string>> stopTrace() = 0;
  /// Writes the content of the flight recorder to a trace and returns its name. Errors: it is switched off or
  /// empty, the folder cannot be written, no space.
  virtual std::future<base::Result<std::string>> dumpTrace() = 0;
  virtual std::future<base::Result<std::vector<drivers::TraceEntry>>> listTraces() = 0;
  virtual std::future<base::Result<void>> deleteTrace(const std::string& name) = 0;
  /// Marks a trace to be kept, or removes the mark. Errors: no such trace, a failure of the disk.
  virtual std::future<base::Result<void>> keepTrace(const std::string& name, bool keep) = 0;
  /// Writes a line of text about a trace beside it; an empty text removes it.
  virtual std::future<base::Result<void>> noteTrace(const std::string& name, const std::string& text) = 0;
  /// Copies the newest depth frame and its state. Errors: there is none yet.
  virtual std::future<base::Result<SceneSnapshot>> takeSnapshot() = 0;
  /// Writes each depth frame into memory that other processes can map, from now until hideDepth(). Not to be
  /// called again before that. Errors: the system has no memory for it.
  virtual base::Result<SharedDepth> shareDepth() = 0;
  /// Ends that, and closes the memory for its readers.
  virtual void hideDepth() = 0;
};

}  // namespace hapticd::daemon
