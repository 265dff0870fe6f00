// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/text/open_metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "drivers/camera/camera.h"
#include "drivers/handle/handle.h"
#include "drivers/trace/trace_format.h"
#include "rt/base/words.h"
#include "rt/loop/loop_state.h"

namespace hapticd::tools {
namespace {

constexpr double kPerNanosecond = 1e-9;

enum class Type { gauge, counter };

/// A family of one sample.
struct Number {
  const char* name;  ///< without "hapticd_" and "_total"
  Type type;
  const char* unit;  ///< the end of the name, or empty
  const char* path;  ///< in the status
  const char* help;
  double scale = 1;  ///< from the status's unit
};

constexpr std::array kNumbers{
    Number{"uptime_seconds", Type::gauge, "seconds", "uptimeS", "Since the start of the daemon."},
    Number{"loop_rate_hertz", Type::gauge, "hertz", "loop.rateHz", "Ticks per second over the last second."},
    Number{"loop_ticks", Type::counter, "", "loop.counters.ticks", "Ticks of the force loop."},
    Number{"loop_overruns", Type::counter, "", "loop.counters.overruns",
           "Ticks that ended after the next one was due."},
    Number{"loop_skipped_periods", Type::counter, "", "loop.counters.skippedPeriods",
           "Whole periods left out because of overruns."},
    Number{"loop_contact_ticks", Type::counter, "", "loop.counters.contactTicks", "Ticks in contact."},
    Number{"loop_outside_model_ticks", Type::counter, "", "loop.counters.outsideModelTicks",
           "Ticks whose neighbourhood was not modelled completely."},
    Number{"loop_slew_limited_ticks", Type::counter, "", "loop.counters.slewLimitedTicks",
           "Ticks whose force was kept from changing too fast."},
    Number{"loop_magnitude_clamped_ticks", Type::counter, "", "loop.counters.magnitudeClampedTicks",
           "Ticks whose force was reduced to the largest permitted one."},
    Number{"loop_not_finite_ticks", Type::counter, "", "loop.counters.notFiniteTicks",
           "Ticks whose force was not finite."},
    Number{"loop_depth_stale_ticks", Type::counter, "", "loop.counters.depthStaleTicks",
           "Ticks with stale depth."},
    Number{"loop_handle_stale_ticks", Type::counter, "", "loop.counters.handleStaleTicks",
           "Ticks with a stale measurement of the handle."},
    Number{"loop_handle_invalid_ticks", Type::counter, "", "loop.counters.handleInvalidTicks",
           "Ticks with an impossible position of the handle."},
    Number{"loop_passivity_ticks", Type::counter, "", "loop.counters.passivityTicks",
           "Ticks damped by passivity control."},
    Number{"loop_thermally_limited_ticks", Type::counter, "", "loop.counters.thermallyLimitedTicks",
           "Ticks with less force because the device is warm."},
    Number{"loop_stiffness_limited_ticks", Type::counter, "", "loop.counters.stiffnessLimitedTicks",
           "Ticks with a force reduced for the delay of the handle."},
    Number{"loop_releases", Type::counter, "", "loop.counters.releases",
           "Releases of the force because of a fault of the handle."},
    Number{"loop_page_faults", Type::counter, "", "loop.pageFaults",
           "Page faults that the force loop had to wait for."},
    Number{"loop_trace_ticks_dropped", Type::counter, "", "loop.traceTicksDropped",
           "Ticks that no reader took out of the loop in time."},
    Number{"loop_transitions", Type::counter, "", "loop.transitions.count",
           "Changes of the mode or its cause."},
    Number{"tick_energy_joules", Type::gauge, "joules", "tick.energyJ",
           "Energy that the hand has put in, less what it got back."},
    Number{"tick_stiffness_limit_newtons_per_metre", Type::gauge, "newtons_per_metre",
           "tick.stiffnessLimitNPerM",
           "Largest stiffness that the delay of the handle and the device allow."},
    Number{"tick_stiffness_gain_ratio", Type::gauge, "ratio", "tick.stiffnessGain",
           "Share of the force of the law that this limit leaves."},
    Number{"tick_contact_damping_newton_seconds_per_metre", Type::gauge, "newton_seconds_per_metre",
           "tick.contactDampingNSPerM", "Damping in contact that the delay calls for."},
    Number{"tick_stiffness_newtons_per_metre", Type::gauge, "newtons_per_metre", "tick.stiffnessNPerM",
           "Stiffness of the surface in effect, configured or automatic."},
    Number{"tick_surface_noise_metres", Type::gauge, "metres", "tick.surfaceNoiseM",
           "Standard deviation of the surface's distance at the proxy from frame to frame."},
    Number{"tick_points", Type::gauge, "", "tick.pointsUsed", "Points that the newest force comes from."},
    Number{"tick_scene_age_seconds", Type::gauge, "seconds", "tick.sceneAgeNs", "Age of the depth in use.",
           kPerNanosecond},
    Number{"fixtures", Type::gauge, "", "fixtures.count", "Virtual fixtures."},
    Number{"fixtures_enabled", Type::gauge, "", "fixtures.enabled", "Virtual fixtures that are enabled."},
    Number{"fixture_distance_metres", Type::gauge, "metres", "fixtures.distanceM",
           "From the interaction point to the nearest forbidden region, negative inside it."},
    Number{"fixture_force_newtons", Type::gauge, "newtons", "fixtures.forceN",
           "Magnitude of the force of all forbidden regions."},
    Number{"guidance_force_newtons", Type::gauge, "newtons", "fixtures.guidanceForceN",
           "Magnitude of the force of all guidance fixtures."},
    Number{"tissue_regions", Type::gauge, "", "tissue.count", "Regions of the stiffness map."},
    Number{"tissue_feed_accepted_samples", Type::counter, "", "tissue.feed.accepted",
           "Samples of measured stiffness applied to a region."},
    Number{"tissue_feed_limited_samples", Type::counter, "", "tissue.feed.limited",
           "Samples of measured stiffness refused because they came too fast."},
    Number{"tissue_feed_outside_samples", Type::counter, "", "tissue.feed.outside",
           "Samples of measured stiffness refused because no region contains their position."},
    Number{"camera_frames", Type::counter, "", "camera.frames", "Frames that the camera has delivered."},
    Number{"camera_damaged_frames", Type::counter, "", "camera.damagedFrames",
           "Frames not delivered because their data could not be trusted."},
    Number{"camera_lost_frames", Type::counter, "", "camera.lostFrames",
           "Frames that never arrived, by the camera's numbering."},
    Number{"camera_temperature_celsius", Type::gauge, "celsius", "camera.details.temperatureC",
           "Temperature of the camera's processor."},
    Number{"scene_frame_rate_hertz", Type::gauge, "hertz", "scene.frameRateHz", "Depth frames per second."},
    Number{"scene_models", Type::counter, "", "scene.models", "Models of the scene built."},
    Number{"scene_remodels", Type::counter, "", "scene.remodels",
           "Models built again because the hand left the part of the scene that was modelled."},
    Number{"scene_points_over_capacity", Type::counter, "", "scene.pointsOverCapacity",
           "Points that did not fit into the model."},
    Number{"scene_skipped_frames", Type::counter, "", "scene.skippedFrames",
           "Frames that a newer one replaced before they were modelled."},
    Number{"scene_points", Type::gauge, "", "scene.points",
           "Points in the newest model; 0 under the law surface, which works on pixels."},
    Number{"scene_model_seconds", Type::gauge, "seconds", "scene.lastModelNs",
           "Time taken to build the newest model.", kPerNanosecond},
    Number{"handle_measurements", Type::counter, "", "handle.measurements", "Measurements of the handle."},
    Number{"handle_thread_priority", Type::gauge, "", "handle.threadPriority",
           "SCHED_FIFO priority of the handle's thread, 0 for none."},
    Number{"handle_rejected", Type::counter, "", "handle.rejected",
           "Measurements of the handle that could not be trusted."},
    Number{"link_sent_messages", Type::counter, "", "handle.link.sent", "Messages sent to the handle."},
    Number{"link_received_messages", Type::counter, "", "handle.link.received",
           "Messages received from the handle."},
    Number{"link_lost_messages", Type::counter, "", "handle.link.lost", "Messages that never arrived."},
    Number{"link_duplicated_messages", Type::counter, "", "handle.link.duplicated",
           "Messages received twice."},
    Number{"link_reordered_messages", Type::counter, "", "handle.link.reordered",
           "Messages received after a newer one."},
    Number{"link_rejected_messages", Type::counter, "", "handle.link.rejected",
           "Messages that were damaged, forged or from somebody else."},
    Number{"trace_ticks_lost", Type::counter, "", "trace.ticksLost",
           "Ticks that are in no file though a trace was requested."},
    Number{"trace_records_lost", Type::counter, "", "trace.recordsLost",
           "Models and events that a trace had no room for."},
    Number{"trace_depth_frames_lost", Type::counter, "", "trace.depthFramesLost",
           "Depth frames not recorded because the disk was too slow."},
    Number{"traces_recovered", Type::counter, "", "trace.recovered",
           "Traces that a crash left open and that were finished at the start."},
    Number{"trace_dumps", Type::counter, "", "trace.dumps", "Dumps of the flight recorder."},
    Number{"traces_finished", Type::counter, "", "trace.traces", "Finished traces."},
    Number{"trace_folder_bytes", Type::gauge, "bytes", "trace.folderBytes", "Size of all traces."},
    Number{"trace_folder_limit_bytes", Type::gauge, "bytes", "trace.folderLimitBytes",
           "Size of all traces above which the oldest are deleted."},
    Number{"traces_deleted", Type::counter, "", "trace.deleted",
           "Traces deleted because all of them together exceeded the limit."},
    Number{"trace_free_bytes", Type::gauge, "bytes", "trace.freeBytes",
           "Free space on the disk of the traces."},
    Number{"control_connections", Type::gauge, "", "control.connections", "Clients that are connected."},
    Number{"control_refused_connections", Type::counter, "", "control.refusedConnections",
           "Connections refused because there were too many."},
    Number{"control_ticks_lost", Type::counter, "", "control.ticksLost",
           "Ticks that the clients' statistics lack because the control thread was too slow."},
    Number{"control_log_entries_lost", Type::counter, "", "control.logEntriesLost",
           "Entries of the log that nothing took."},
    Number{"control_notifications_lost", Type::counter, "", "control.notificationsLost",
           "Notifications that the service manager did not take in time."},
    Number{"control_longest_gap_seconds", Type::gauge, "seconds", "control.longestGapNs",
           "Longest time between two periods of the control thread.", kPerNanosecond},
};

/// Families of durations, as summaries.
struct Durations {
  const char* name;
  const char* path;
  const char* help;
};
constexpr std::array kDurations{
    Durations{"loop_wakeup_latency_seconds", "loop.wakeupLatency",
              "From the planned to the actual begin of a tick."},
    Durations{"loop_compute_seconds", "loop.computeTime", "From the begin to the end of a tick."},
    Durations{"handle_last_hop_seconds", "handle.lastHop",
              "From the writing of a command by the force loop to its sending to the handle."},
    Durations{"link_round_trip_seconds", "handle.link.roundTrip",
              "From sending to the handle to its answer."},
};

struct Quantile {
  const char* label;
  const char* field;
};
constexpr std::array<Quantile, 4> kQuantiles{
    {{"0.5", "p50Ns"}, {"0.99", "p99Ns"}, {"0.999", "p999Ns"}, {"1", "maxNs"}}};

/// A word that is one of several, as a StateSet.
struct States {
  const char* name;
  const char* path;
  const char* help;
  std::span<const std::string_view> known;
};
constexpr std::array kStates{
    States{"mode", "mode", "Mode of the force loop.", rt::kWords<rt::Mode>},
    States{"camera_state", "camera.state", "State of the depth camera.", rt::kWords<drivers::CameraState>},
    States{"handle_state", "handle.state", "State of the haptic handle.",
           rt::kWords<drivers::HandlePresence>},
    States{"trace_state", "trace.state", "State of the trace.", rt::kWords<drivers::TraceState>},
    States{"force_law", "law.chosen", "Force law in use.", rt::kWords<rt::ForceLaw>},
    States{"stiffness_bound", "tick.stiffnessBound", "What limits the stiffness of the surface.",
           rt::kWords<rt::StiffnessBound>},
};

/// Writes families, each with its head, in one of the two formats.
class MetricsWriter {
 public:
  explicit MetricsWriter(MetricsFormat format) : prometheus_(format == MetricsFormat::prometheus) {}

  /// Begins a family. Prometheus' format names the samples there, and has neither units nor all types.
  void begin(std::string_view name, std::string_view type, std::string_view unit, std::string_view help) {
    sample_ = fmt::format("hapticd_{}{}", name, type == "counter" ? "_total" : type == "info" ? "_info" : "");
    const std::string family = prometheus_ ? sample_ : fmt::format("hapticd_{}", name);
    const bool known = type == "counter" || type == "gauge" || type == "summary";
    text_ += fmt::format("# TYPE {} {}\n", family, known || !prometheus_ ? type : "gauge");
    if (!unit.empty() && !prometheus_) text_ += fmt::format("# UNIT {} {}\n", family, unit);
    text_ += fmt::format("# HELP {} {}\n", family, help);
  }
  /// Adds a sample to it. `labels`: none, or with their braces.
  void add(const std::string& labels, double value) {
    text_ += fmt::format("{}{} {}\n", sample_, labels, value);
  }
  std::string text() const { return prometheus_ ? text_ : text_ + "# EOF\n"; }

 private:
  bool prometheus_;
  std::string sample_;
  std::string text_;
};

void add(MetricsWriter& metrics, const Number& number, const Json& status) {
  const double value = numberAt(status, number.path);
  if (std::isnan(value)) return;
  metrics.begin(number.name, number.type == Type::counter ? "counter" : "gauge", number.unit, number.help);
  metrics.add("", value * number.scale);
}

void add(MetricsWriter& metrics, const Durations& durations, const Json& status) {
  bool begun = false;
  for (const Quantile& quantile : kQuantiles) {
    const double value = numberAt(status, fmt::format("{}.{}", durations.path, quantile.field));
    if (std::isnan(value)) continue;
    if (!std::exchange(begun, true)) metrics.begin(durations.name, "summary", "seconds", durations.help);
    metrics.add(fmt::format("{{quantile=\"{}\"}}", quantile.label), value * kPerNanosecond);
  }
}

void add(MetricsWriter& metrics, const States& states, const Json& status) {
  const std::string now = textAt(status, states.path);
  if (now == "-") return;
  metrics.begin(states.name, "stateset", "", states.help);
  const auto sample = [&](std::string_view state) {
    metrics.add(fmt::format("{{hapticd_{}=\"{}\"}}", states.name, labelValue(state)), state == now ? 1 : 0);
  };
  for (const std::string_view state : states.known) sample(state);
  // a newer daemon may know more states
  if (std::ranges::find(states.known, std::string_view(now)) == states.known.end()) sample(now);
}

/// Transitions by cause: a family of several samples.
void addTransitionCauses(MetricsWriter& metrics, const Json& status) {
  const Json* causes = fieldAt(status, "loop.transitions.byCause");
  if (!causes || !causes->is_object() || causes->empty()) return;
  metrics.begin("loop_transitions_by_cause", "counter", "", "Changes of the mode, by their cause.");
  for (const auto& [cause, count] : causes->items()) {
    if (!count.is_number()) continue;
    metrics.add(fmt::format("{{cause=\"{}\"}}", labelValue(cause)), count.get<double>());
  }
}

/// A value of a family whose samples differ in one label.
struct Labelled {
  std::string_view value;
  double number;
};

/// A gauge with a sample for each label whose number is known; left out if none is.
void addLabelled(MetricsWriter& metrics, std::string_view name, std::string_view unit, std::string_view help,
                 std::string_view label, std::span<const Labelled> samples) {
  bool begun = false;
  for (const Labelled& sample : samples) {
    if (std::isnan(sample.number)) continue;
    if (!std::exchange(begun, true)) metrics.begin(name, "gauge", unit, help);
    metrics.add(fmt::format("{{{}=\"{}\"}}", label, sample.value), sample.number);
  }
}

/// The family that identifies the daemon. Its labels change with an update only: a label whose value changed
/// while the daemon runs would begin another time series.
void addInformation(MetricsWriter& metrics, const Json& status) {
  metrics.begin("build", "info", "", "Versions of hapticd and of the kernel.");
  metrics.add(fmt::format("{{version=\"{}\",kernel=\"{}\"}}", labelValue(textAt(status, "version")),
                          labelValue(textAt(status, "kernel"))),
              1);
}

void addCount(MetricsWriter& metrics, std::string_view name, std::string_view help, const Json& status,
              const char* path) {
  if (!fieldAt(status, path)) return;
  metrics.begin(name, "gauge", "", help);
  metrics.add("", static_cast<double>(listAt(status, path).size()));
}

}  // namespace

std::string labelValue(std::string_view text) {
  std::string escaped;
  for (const char character : text) {
    if (character == '\\' || character == '"') escaped += '\\';
    escaped += character == '\n' ? std::string("\\n") : std::string(1, character);
  }
  return escaped;
}

std::string metricsOf(const Json& status, MetricsFormat format) {
  MetricsWriter metrics(format);
  const bool up = status.is_object();
  metrics.begin("up", "gauge", "", "Whether the daemon answers.");
  metrics.add("", up ? 1 : 0);
  if (!up) return metrics.text();
  addInformation(metrics, status);
  addCount(metrics, "warnings", "Warnings of the daemon at this moment.", status, "warnings");
  for (const States& states : kStates) add(metrics, states, status);
  for (const Number& number : kNumbers) add(metrics, number, status);
  for (const Durations& durations : kDurations) add(metrics, durations, status);
  addTransitionCauses(metrics, status);
  addLabelled(metrics, "tick_force_newtons", "newtons", "Magnitude of the newest force.", "stage",
              std::array{Labelled{"law", lengthAt(status, "tick.lawForceNInWorld")},
                         Labelled{"command", lengthAt(status, "tick.commandForceNInWorld")}});
  addLabelled(metrics, "tick_hip_metres", "metres", "The haptic interaction point in the world.", "axis",
              std::array{Labelled{"x", numberAt(status, "tick.hipMInWorld.x")},
                         Labelled{"y", numberAt(status, "tick.hipMInWorld.y")},
                         Labelled{"z", numberAt(status, "tick.hipMInWorld.z")}});
  addCount(metrics, "fixtures_in_contact",
           "Virtual fixtures that hold the interaction point back or guide it.", status,
           "fixtures.inContact");
  return metrics.text();
}

}  // namespace hapticd::tools
