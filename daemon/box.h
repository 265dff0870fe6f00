#pragma once

#include <array>
#include <cstdint>
#include <functional>
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

/// Percentiles of one of the loop's histograms, nanoseconds.
struct LatencySummary {
  std::uint64_t p50_ns = 0;
  std::uint64_t p99_ns = 0;
  std::uint64_t p999_ns = 0;
  std::uint64_t max_ns = 0;
};

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
  double voxel_edge_m = 0;      ///< of the law surface
  bool filtered = false;        ///< depth passes a filter
  double expected_error_n = 0;  ///< measured for this law, resolution and distance; 0: not known
  double max_error_n = 0;       ///< that the law auto may make
  double distance_m = 0;        ///< of what is felt, from the camera; 0: not known
  /// k_s times motion and force scale, as far as the handle's delay allows: what the hand feels.
  double hand_stiffness_n_per_m = 0;
};

/// How an LED shines; isLit() (indicators.h) has the times.
enum class LedPattern { off, on, slow_blink, fast_blink, double_blink };

/// Of each drivers::Led, at its number.
using LedPatterns = std::array<LedPattern, drivers::kLedCount>;

struct IndicatorStatus {
  drivers::LedStatus panel;
  LedPatterns patterns{};  ///< of the LEDs that are configured, the others show nothing
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
  /// Requests `engaged` or `idle`. `inside`: also where something is felt at once. Returns the generation to
  /// wait for.
  virtual std::uint64_t engage(bool engaged, bool inside) = 0;
  /// The newest generation that the force loop has taken over.
  virtual std::uint64_t acknowledgedGeneration() = 0;
};

}  // namespace hapticd::daemon
