// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/recordings/recordings_bounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/hapticbench/accuracy/force_error.h"
#include "tools/hapticbench/force_series.h"

namespace hapticd::tools {
namespace {

constexpr double kFlatSize_m = 0.16;

/// All surfaces of one law whose distance is from..to.
DistanceClassResult pooled(std::span<const SessionResult> sessions, config::LawChoice law, double from_m,
                           double to_m, double least_size_m) {
  DistanceClassResult result{.law = law, .from_m = from_m, .to_m = to_m, .stroke = {}, .still = {}};
  double squares = 0;
  for (const SessionResult& session : sessions) {
    for (const SurfaceRow& row : session.surfaces) {
      const bool belongs = row.law == law && row.surface.distance_m >= from_m &&
                           row.surface.distance_m < to_m && row.surface.size_m >= least_size_m;
      if (!belongs) continue;
      ++result.surfaces;
      squares += std::pow(row.stiffness_n_per_m * row.surface.fit_error_m, 2);
      result.stroke.add(row.stroke);
      result.still.add(row.still);
    }
  }
  if (result.surfaces == 0) return result;
  result.fit_error_n = std::sqrt(squares / result.surfaces);
  result.jnd_n = justNoticeableDifference_n(result.still.largest_true_n);
  return result;
}

double lostPercentOf(const SurfaceError& error) {
  return error.error_n.empty()
             ? 0
             : 100 * static_cast<double>(error.lost) / static_cast<double>(error.error_n.size());
}

struct DistanceLimit {
  double from_m;
  double to_m;
  double limit;
};

void addLostContact(std::span<const SessionResult> sessions, config::LawChoice law,
                    std::vector<Bound>& bounds) {
  constexpr DistanceLimit kLimits[] = {{0, 2, 0}, {2, 3.05, 5}};
  for (const auto& [from_m, to_m, limit] : kLimits) {
    const DistanceClassResult result = pooled(sessions, law, from_m, to_m, kFlatSize_m);
    const std::string what = "contact lost in strokes on flat surfaces of 160 mm, " +
                             std::string(to_m <= 2 ? "to 2 m" : "2 to 3 m");
    bounds.push_back(result.surfaces == 0 ? Bound::notMeasured(std::string(nameOf(law)), what)
                                          : Bound::atMost(std::string(nameOf(law)), what, limit,
                                                          lostPercentOf(result.stroke), "%"));
  }
}

void addError(std::span<const SessionResult> sessions, config::LawChoice law, std::vector<Bound>& bounds) {
  const DistanceClassResult result = pooled(sessions, law, 0, 1.2, kFlatSize_m);
  const std::string what = "RMS error in strokes on flat surfaces of 160 mm, to 1.2 m";
  bounds.push_back(result.surfaces == 0
                       ? Bound::notMeasured(std::string(nameOf(law)), what)
                       : Bound::atMost(std::string(nameOf(law)), what, 1,
                                       rootMeanSquare(result.stroke.error_n) / result.jnd_n, "JND"));
}

void addSteps(std::span<const SessionResult> sessions, config::LawChoice law, std::vector<Bound>& bounds) {
  constexpr DistanceLimit kLimits[] = {{0, 1.2, 0.05}, {1.2, 2.75, 0.2}};
  for (const auto& [from_m, to_m, limit] : kLimits) {
    const DistanceClassResult result = pooled(sessions, law, from_m, to_m, 0);
    const std::string what = "change of the force at a new frame, HIP still, 99 of 100, " +
                             std::string(to_m <= 1.2 ? "to 1.2 m" : "1.2 to 2.7 m");
    bounds.push_back(result.surfaces == 0 ? Bound::notMeasured(std::string(nameOf(law)), what)
                                          : Bound::atMost(std::string(nameOf(law)), what, limit,
                                                          quantile(result.still.new_frame_n, 0.99), "N"));
  }
}

void addPassing(std::span<const SessionResult> sessions, config::LawChoice law, std::vector<Bound>& bounds) {
  PassingError free;
  PassingError pressing;
  for (const SessionResult& session : sessions) {
    for (const PassingRow& row : session.passings) {
      if (row.law != law) continue;
      free.add(row.free);
      pressing.add(row.pressing);
    }
  }
  const std::string name(nameOf(law));
  if (free.ghost.ticks == 0) {
    bounds.push_back(Bound::notMeasured(name, "force on a free HIP that something passes"));
    return;
  }
  bounds.push_back(Bound::atMost(name,
                                 "force on a HIP 30 mm in front of what rests, while people pass, largest",
                                 0.1, free.ghost.largest, "N"));
  bounds.push_back(Bound::atMost(name, "the same, ticks above 0.1 N", 0, free.ghost.percent(), "%"));
  bounds.push_back(Bound::atMost(name, "error of a pressing HIP while something passes above 0.5 N, longest",
                                 100, static_cast<double>(pressing.error.longest), "ms"));
  bounds.push_back(Bound::atMost(
      name, fmt::format("the same as a change; while nothing passes up to {} ms", pressing.calm.longest), 100,
      static_cast<double>(pressing.change.longest), "ms"));
}

}  // namespace

std::vector<DistanceClassResult> byDistance(std::span<const SessionResult> sessions,
                                            const RecordingsOptions& options, double least_size_m) {
  std::vector<DistanceClassResult> results;
  const std::vector<double>& borders_m = options.surfaces.class_borders_m;
  for (const config::LawChoice law : options.laws) {
    for (std::size_t i = 0; i + 1 < borders_m.size(); ++i) {
      auto result = pooled(sessions, law, borders_m[i], borders_m[i + 1], least_size_m);
      if (result.surfaces > 0) results.push_back(std::move(result));
    }
  }
  return results;
}

std::vector<Bound> recordingsBounds(std::span<const SessionResult> sessions,
                                    const RecordingsOptions& options) {
  std::vector<Bound> bounds;
  for (const config::LawChoice law : options.laws) {
    addPassing(sessions, law, bounds);
    addLostContact(sessions, law, bounds);
    addError(sessions, law, bounds);
    addSteps(sessions, law, bounds);
  }
  return bounds;
}

}  // namespace hapticd::tools
