// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <tuple>
#include <type_traits>

#include "rt/base/fields.h"
#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"

namespace hapticd::rt {

/// Measures how late forces act on the hand: the time from a command to the motion that it causes, as the
/// positions show it. No echo of a device tells of a latency behind its communication, but a loop that is
/// stable without it is not with it.
///
/// A knock, pairs of opposite pulses of 10 ms, moves a device of 45 to 300 g by 0.1 to 1 mm to and fro. For
/// each latency the motion is fitted by the commands that far back, acting on a mass with a damper, a spring
/// and a hand that pushes with a slowly changing force (least squares over second differences across 20 ms,
/// in which a hand's own motion cancels). The latency whose fit explains most is the result. All forces
/// count, not the knock alone. Thread: one.  Progress: wait-free.  RT: safe.
class LatencyProbe {
 public:
  /// Force of the knock, at the hand.
  static constexpr double kKnock_n = 0.5;
  /// Longest latency that is looked for.
  static constexpr std::size_t kMaxLatency_ticks = 60;

  struct Input {
    double position_m = 0;  ///< of the hand, along the knock's direction
    double command_n = 0;   ///< of the previous tick, along that direction
    double period_s = 0;
  };

  /// Begins a measurement; one that runs begins again.
  void start() noexcept;
  bool isRunning() const noexcept { return phase_ != Phase::off; }
  /// Ends a measurement without a result.
  void stop() noexcept { phase_ = Phase::off; }

  /// Runs one tick of a measurement. Returns the force to add to the command, in newtons along the direction.
  double step(const Input& input) HAPTICD_RT;

  /// Result of the last measurement that ended.
  struct Result {
    std::uint32_t number = 0;  ///< of measurements that have ended; 0: none
    bool conclusive = false;   ///< the hand moved as the knock lets it
    double latency_s = 0;      ///< from a command to the motion
    double explained = 0;      ///< share of the commands that the fit explains with that latency, 0..1
    double mass_kg = 0;        ///< of device and hand, as they moved
  };
  const Result& result() const noexcept { return result_; }

 private:
  enum class Phase : std::uint8_t { off, knocking, comparing };
  static constexpr std::size_t kPulse_ticks = 10;
  static constexpr std::size_t kPairs = 8;
  static constexpr std::size_t kKnock_ticks = 2 * kPulse_ticks * kPairs;
  static constexpr std::size_t kSamples = kKnock_ticks + kMaxLatency_ticks;

  double termAt(std::size_t term, std::size_t t) const noexcept;
  void prepare() noexcept;
  void compare() noexcept;

  /// Positions and their first and second integral, as the fit takes them; then a constant, linear and
  /// quadratic term.
  static constexpr std::size_t kIntegrals = 3;
  static constexpr std::size_t kTerms = 6;

  Phase phase_ = Phase::off;
  std::size_t tick_ = 0;  ///< sample to take, or latency to compare
  double period_s_ = 0;
  double origin_m_ = 0;
  double momentum_n_s_ = 0;
  std::array<std::array<double, kSamples>, kIntegrals> motion_{};
  std::array<double, kSamples> pushed_kg_m_{};  ///< the commands, integrated twice
  std::array<std::array<double, kTerms>, kTerms>
      normal_{};  ///< normal matrix of the fit, then its Cholesky factor
  Result best_;   ///< of the latencies compared so far
  Result result_;
};

template <std::same_as<LatencyProbe::Result> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(number, "Number of measurements that have ended").named("measurements"),
      HAPTICD_FIELD(conclusive,
                    "Whether the newest one can be relied on: the hand moved as the knock lets it"),
      HAPTICD_FIELD(latency_s, "From a command of the box to the motion that it causes; null: not conclusive")
          .shownAs([](const auto& result) {
            return result.conclusive ? std::optional(result.latency_s) : std::nullopt;
          }),
      HAPTICD_FIELD(mass_kg, "Moving mass of device and hand; null: not conclusive")
          .shownAs([](const auto& result) {
            return result.conclusive ? std::optional(result.mass_kg) : std::nullopt;
          }),
      HAPTICD_FIELD(explained, "Share of the commands that explain the motion with that latency, 0..1")};
}

}  // namespace hapticd::rt
