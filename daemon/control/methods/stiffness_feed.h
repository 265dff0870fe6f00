// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <expected>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "config/base/rate_limit.h"
#include "config/settings/fixture_settings.h"
#include "daemon/base/box.h"
#include "rt/base/vec3.h"

namespace hapticd::daemon {

/// Measurements of stiffness by estimators, written into the tissue regions: each goes into the weighted mean
/// of the region that contains its position. Their rate is limited, and so is that of the changes which
/// follow from them. Thread: control thread only.
class StiffnessFeed {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr int kMaxPerSecond = 200;
  static constexpr std::chrono::milliseconds kChangeInterval{50};
  static constexpr double kMaxPastWeight = 50;

  struct Sample {
    rt::Vec3 position_m_in_world;  ///< finite
    double stiffness_n_per_m = 0;
    std::optional<double> damping_n_s_per_m;
    double weight = 1;  ///< > 0, at most kMaxPastWeight
  };
  /// A region after a sample.
  struct Accepted {
    std::string region;
    double stiffness_n_per_m = 0;  ///< its mean
    bool begins = false;           ///< no sample has come to this region for a while
  };
  struct TooFast {};
  struct Outside {};
  using Refusal = std::variant<TooFast, Outside, config::AdditionError>;

  explicit StiffnessFeed(Box& box) : box_(box) {}

  /// Takes one sample. `now`: not earlier than in the last call.
  std::expected<Accepted, Refusal> take(const Sample& sample, Clock::time_point now);
  /// Hands what has changed to the box, if it is time.
  void periodic(Clock::time_point now);
  /// Hands it to the box at once, before the regions are changed otherwise.
  void flush();

  const FeedStatus& status() const { return status_; }

 private:
  /// The mean of one region.
  struct Mean {
    double stiffness_weight = 0;
    double damping_weight = 0;
    Clock::time_point newest;
  };

  void followBox();

  Box& box_;
  std::vector<config::RegionSettings> regions_;
  std::uint64_t generation_ = 0;  // of regions_
  bool known_ = false;            // regions_ have been read once
  std::map<std::string, Mean, std::less<>> means_;
  base::RateLimit rate_{kMaxPerSecond};
  bool waits_ = false;  // regions_ has changes for the box
  Clock::time_point changed_{};
  FeedStatus status_;
};

}  // namespace hapticd::daemon
