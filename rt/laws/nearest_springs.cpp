// SPDX-License-Identifier: Apache-2.0
#include "rt/laws/nearest_springs.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {
namespace {

/// Free space is searched this much beyond D_thresh, and then not again until the HIP has moved as far.
constexpr double kFreeSpaceLookAhead_m = 0.01;

float squared(double length_m) noexcept {
  return static_cast<float>(length_m * length_m);
}

}  // namespace

SearchMemory::SearchMemory(std::size_t point_capacity)
    : distance_squared_m2_(std::make_unique<float[]>(point_capacity + kVectorPadding)),
      pixel_(std::make_unique<std::uint32_t[]>(point_capacity + kVectorPadding)),
      boundary_pixel_(std::make_unique<std::uint32_t[]>(point_capacity + kVectorPadding)),
      ranked_(std::make_unique<Ranked[]>(point_capacity + kVectorPadding)),
      work_(std::make_unique<WorkVector[]>(point_capacity + kVectorPadding)) {}

/// One search for the points of eq. (6)-(8).
///
/// The grid is searched in single precision, with distances that are within `error_m_` of the exact ones.
/// Points whose distance is more than `error_m_` from the limits are therefore surely chosen or surely
/// rejected; for the few in between, exact positions decide.
class NearestSearch {
 public:
  NearestSearch(const Scene& scene, const Vec3& hip_m_in_world, const SpringParameters& parameters,
                SearchMemory& memory) noexcept
      : scene_(scene),
        hip_(hip_m_in_world),
        parameters_(parameters),
        memory_(memory),
        candidates_{memory.distance_squared_m2_.get(), memory.pixel_.get(), 0},
        boundary_(memory.boundary_pixel_.get()),
        error_m_(scene.depth_model->singlePrecisionError_m()),
        max_points_(static_cast<std::uint32_t>(parameters.max_points)) {}

  ForceSample force() noexcept {
    if (scene_.points < static_cast<std::uint32_t>(parameters_.min_points) || isKnownToBeFree()) return {};
    const bool enough_found = findCandidates();
    if (candidates_.count < static_cast<std::uint32_t>(parameters_.min_points)) return {};
    if (enough_found) return forceOfNearest();
    return forceOfAll();
  }

 private:
  bool isKnownToBeFree() const noexcept {
    return memory_.guess_.free_model == scene_.model &&
           norm(hip_ - memory_.guess_.free_centre_m_in_world) + parameters_.radius_m <=
               memory_.guess_.free_radius_m;
  }

  /// Finds all points whose exact distance is at most `radius_m`, and possibly some slightly farther away.
  void find(double radius_m) noexcept {
    found_radius_m_ = radius_m + error_m_;
    const Vec3 local = hip_ - scene_.origin_m_in_world;
    findInBall(scene_,
               {static_cast<float>(local.x), static_cast<float>(local.y), static_cast<float>(local.z),
                static_cast<float>(found_radius_m_)},
               candidates_);
  }

  /// Finds at least the points to choose from; returns true if more than enough of them lie within D_thresh.
  bool findCandidates() noexcept {
    const double limit = parameters_.radius_m;
    // A ball that held N_max points still holds them when it grows by the displacement of the HIP, if the
    // scene is the same. This is checked by counting, so a wrong guess only costs time.
    double guess = memory_.guess_.last_radius_m == 0
                       ? limit / 3
                       : memory_.guess_.last_radius_m + kSlack_m +
                             std::min(norm(hip_ - memory_.guess_.last_hip_m_in_world), kMaxMovement_m);
    memory_.guess_.last_hip_m_in_world = hip_;
    for (; guess < limit; guess *= kGrowth) {
      find(guess);
      if (countWithin(candidates_, squared(guess - error_m_)) >= max_points_) return true;
    }
    find(limit);
    if (countWithin(candidates_, squared(limit - error_m_)) >= max_points_) return true;
    memory_.guess_.last_radius_m = limit;
    if (candidates_.count == 0) rememberFreeSpace();
    return false;
  }

  void rememberFreeSpace() noexcept {
    const double radius = parameters_.radius_m + kFreeSpaceLookAhead_m;
    if (!scene_.covers(hip_, radius)) return;
    find(radius);
    if (candidates_.count != 0) {
      candidates_.count = 0;
      return;
    }
    memory_.guess_.free_model = scene_.model;
    memory_.guess_.free_centre_m_in_world = hip_;
    memory_.guess_.free_radius_m = radius;
  }

  /// Uses all candidates within D_thresh, eq. (7), or none, eq. (8); there are at most slightly more than
  /// N_max.
  ForceSample forceOfAll() noexcept {
    std::uint32_t within = 0;
    for (std::uint32_t i = 0; i < candidates_.count; ++i) {
      const Vec3 v = hip_ - scene_.depth_model->pointInWorld(candidates_.pixel[i], scene_.raw_first);
      if (norm(v) > parameters_.radius_m) continue;
      memory_.ranked_[within++] = {dot(v, v), candidates_.pixel[i]};
    }
    if (within < static_cast<std::uint32_t>(parameters_.min_points)) return {};
    candidates_.count = 0;
    chooseNearestRanked(within, std::min(within, max_points_));
    return meanOfChosen();
  }

  /// Uses the N_max nearest of more candidates, eq. (6).
  ForceSample forceOfNearest() noexcept {
    const Bracket bracket = bracketOfRank();
    memory_.guess_.last_radius_m = std::sqrt(static_cast<double>(bracket.above_m2)) + error_m_;
    const double surely_near = std::sqrt(static_cast<double>(bracket.below_m2)) - 2 * error_m_;
    const double maybe_near = std::sqrt(static_cast<double>(bracket.above_m2)) + 2 * error_m_;
    const std::uint32_t between = takeBetween(candidates_, surely_near > 0 ? squared(surely_near) : -1.0F,
                                              squared(maybe_near), boundary_);
    for (std::uint32_t i = 0; i < between; ++i) {
      const Vec3 v = hip_ - scene_.depth_model->pointInWorld(boundary_[i], scene_.raw_first);
      memory_.ranked_[i] = {dot(v, v), boundary_[i]};
    }
    chooseNearestRanked(between, max_points_ - candidates_.count);
    return meanOfChosen();
  }

  /// Evaluates eq. (11) over the chosen candidates.
  ForceSample meanOfChosen() noexcept {
    const Vec3 sum = sumOfUnitSprings(scene_, candidates_.pixel, candidates_.count, hip_,
                                      parameters_.radius_m, memory_.work_.get());
    return {.force_n_in_world = (parameters_.stiffness_n_per_m / candidates_.count) * sum,
            .points_used = candidates_.count};
  }

  /// Adds the `chosen` nearest of the first `count` ranked points to the candidates.
  void chooseNearestRanked(std::uint32_t count, std::uint32_t chosen) noexcept {
    SearchMemory::Ranked* const ranked = memory_.ranked_.get();
    if (chosen < count) {
      std::nth_element(ranked, ranked + chosen, ranked + count,
                       [](const SearchMemory::Ranked& a, const SearchMemory::Ranked& b) {
                         if (a.distance_squared_m2 != b.distance_squared_m2) {
                           return a.distance_squared_m2 < b.distance_squared_m2;
                         }
                         return a.pixel < b.pixel;
                       });
    }
    for (std::uint32_t i = 0; i < chosen; ++i) candidates_.pixel[candidates_.count++] = ranked[i].pixel;
  }

  /// Squared distances such that fewer than N_max candidates lie within `below_m2` and at least N_max within
  /// `above_m2`.
  struct Bracket {
    float below_m2;
    float above_m2;
  };

  /// Brackets the distance of the N_max-th nearest candidate. On a surface the number of points grows about
  /// linearly with the squared distance, so a few steps of linear interpolation suffice; every third step
  /// bisects, so that the number of steps is bounded for any distribution of distances.
  Bracket bracketOfRank() const noexcept {
    constexpr std::uint32_t kCloseEnough = 6;  // number of candidates whose exact positions are evaluated
    constexpr int kMaxSteps = 24;
    Bracket bracket{0, squared(found_radius_m_)};
    std::uint32_t count_below = countWithin(candidates_, bracket.below_m2);
    std::uint32_t count_above = candidates_.count;
    if (count_below >= max_points_) return {-1.0F, bracket.below_m2};
    for (int step = 1; step <= kMaxSteps && count_above - count_below > kCloseEnough; ++step) {
      const float fraction = step % 3 == 0 ? 0.5F
                                           : (static_cast<float>(max_points_ - count_below) + 0.5F) /
                                                 static_cast<float>(count_above - count_below + 1);
      const float middle = bracket.below_m2 + fraction * (bracket.above_m2 - bracket.below_m2);
      const std::uint32_t count = countWithin(candidates_, middle);
      if (count >= max_points_) {
        bracket.above_m2 = middle;
        count_above = count;
      } else {
        bracket.below_m2 = middle;
        count_below = count;
      }
    }
    return bracket;
  }

  static constexpr double kSlack_m = 0.0003;
  static constexpr double kMaxMovement_m =
      0.002;  // per tick; after a larger displacement the previous radius is as good a guess
  static constexpr double kGrowth = 1.5;

  const Scene& scene_;
  const Vec3 hip_;
  const SpringParameters& parameters_;
  SearchMemory& memory_;
  Candidates candidates_;
  std::uint32_t* boundary_;
  const double error_m_;
  const std::uint32_t max_points_;
  double found_radius_m_ = 0;
};

ForceSample nearestSprings(const Scene& scene, const Vec3& hip_m_in_world, const SpringParameters& parameters,
                           SearchMemory& memory) HAPTICD_RT {
  if (scene.frame == 0 || !isFinite(hip_m_in_world)) return {};
  return NearestSearch(scene, hip_m_in_world, parameters, memory).force();
}

}  // namespace hapticd::rt
