// SPDX-License-Identifier: Apache-2.0
#include "rt/standoff.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace hapticd::rt {
namespace {

/// The proxy has arrived when it moves by less.
constexpr double kArrived_m = 1e-5;
constexpr int kMaxLooks = 4;
/// Number of frames for which what was seen holds where the surface has no measurement.
constexpr std::uint64_t kHeldFrames = 30;
/// Stand-offs look for the surface from this far in front of their boundary.
constexpr double kAhead_m = 0.01;
/// Most energy that a proxy may give back: more than its looks disagree by.
constexpr double kMaxSpare_j = 1e-6;
/// The same at the beginning of a contact.
constexpr double kFirstSpare_j = 1e-7;
/// A look serves for the first step of the next tick if the proxy is no farther from where it was taken.
constexpr double kNextToLook_m = 5e-4;
/// Pieces of the surface whose normals differ by less, 20 degrees, are the same one.
constexpr double kSamePiece = 0.94;
/// A piece beside the nearest one is looked for from a place that is farther from the latter by this.
constexpr double kProbe_m = 0.002;

/// The live surface is curved and may end: a step is no longer than the distance from it, or two pixels.
double maxStep_m(const LiveSurface& surface, const Vec3& place_m, double surface_m) noexcept {
  constexpr double kShare = 0.9;
  constexpr double kStride_px = 2;
  return std::max(kShare * surface_m, kStride_px * surface.pitch_m(place_m));
}

/// The proxy of one stand-off in one tick.
class Follower {
 public:
  Follower(LiveSurface& surface, double clearance_m, const RegionMemory& region, const Vec3& hip_m,
           const Vec3& motion_m, const Vec3& from_m, StandoffMemory& memory) noexcept
      : surface_(surface),
        clearance_m_(clearance_m),
        region_(region),
        hip_(hip_m),
        motion_(motion_m),
        proxy_(from_m),
        memory_(memory) {}

  StandoffPlace follow() noexcept {
    const bool same_surface = moveWithSurface();
    const Vec3 start = proxy_;
    if (same_surface && norm(proxy_ - memory_.from_m) <= kNextToLook_m)
      step(maxStep_m(surface_, proxy_, memory_.surface_m));
    // Where the proxy was is allowed as long as the surface is the same.
    Vec3 allowed = start;
    bool found = same_surface;
    int looks = 0;
    while (looks < kMaxLooks) {
      if (!surface_.isAvailable() || !lookFromProxy(looks)) {
        holdWithoutSurface();
        return place();
      }
      if (memory_.surface_m - clearance_m_ >= -kArrived_m) {
        allowed = proxy_;
        found = true;
      }
      if (step(maxStep_m(surface_, memory_.from_m, memory_.surface_m)) < kArrived_m) break;
    }
    if (found) proxy_ = allowed;
    const bool in_contact = same_surface && region_.depth_m > 0 && !(proxy_ == hip_);
    if (in_contact) lagWhereGained(start);
    memory_.spare_j = in_contact ? std::clamp(spare_j(start, proxy_), 0.0, kMaxSpare_j) : kFirstSpare_j;
    return place();
  }

 private:
  /// Moves the proxy and what holds it with the surface. Returns false if the surface is another one than at
  /// the last look.
  bool moveWithSurface() noexcept {
    project();
    if (memory_.model == 0 || memory_.model != surface_.model()) return false;
    const double elapsed_s = surface_.age_s() - memory_.age_s;
    memory_.age_s = surface_.age_s();
    for (std::size_t k = 0; k < memory_.count; ++k) {
      StandoffCut& cut = memory_.cuts[k];
      const double moved_m = cut.speed_m_per_s * elapsed_s;
      cut.half_space.offset_m += moved_m;
      memory_.surface_m -= std::abs(moved_m);
      if (multipliers_[k] > 0) proxy_ += moved_m * cut.half_space.normal;
    }
    return true;
  }

  double springDepth_m(const Vec3& proxy_m, const Vec3& hip_m) const noexcept {
    return std::max(0.0, norm(proxy_m - hip_m) - region_.give_m);
  }
  Vec3 force_n(const Vec3& proxy_m, const Vec3& hip_m) const noexcept {
    const double spring_n = region_.spring().force_n(springDepth_m(proxy_m, hip_m));
    return spring_n > 0 ? (spring_n / norm(proxy_m - hip_m)) * (proxy_m - hip_m) : Vec3{};
  }
  double energy_j(const Vec3& proxy_m, const Vec3& hip_m) const noexcept {
    return region_.spring().energy_j(springDepth_m(proxy_m, hip_m));
  }
  /// What the hand will have put into the spring beyond the energy in it, with the proxy moved from `start_m`
  /// to a place.
  double spare_j(const Vec3& start_m, const Vec3& proxy_m) const noexcept {
    const Vec3 hip_before = hip_ - motion_;
    const double given_j = -0.5 * dot(force_n(start_m, hip_before) + force_n(proxy_m, hip_), motion_);
    return memory_.spare_j + given_j + energy_j(start_m, hip_before) - energy_j(proxy_m, hip_);
  }

  /// Lets the proxy lag as little as takes out of the spring what its move would give the hand: a friction in
  /// proportion to how much distance and normal of the surface disagree.
  void lagWhereGained(const Vec3& start_m) noexcept {
    const double least_j = std::min(0.0, spare_j(start_m, start_m));
    if (!(springDepth_m(proxy_, hip_) > 0) || spare_j(start_m, proxy_) >= least_j) return;
    const Vec3 aim = proxy_;
    const auto lagging = [&](double share) { return aim + share * (start_m - aim); };
    double gains = 0;
    double enough = 0.5;  // more lag puts more into the spring than it takes from the hand
    if (spare_j(start_m, lagging(enough)) < least_j) {
      proxy_ = start_m;
      return;
    }
    constexpr int kHalvings = 8;
    for (int i = 0; i < kHalvings; ++i) {
      const double share = 0.5 * (gains + enough);
      (spare_j(start_m, lagging(share)) < least_j ? gains : enough) = share;
    }
    proxy_ = lagging(enough);
  }

  StandoffCut cutOf(const SurfaceDistance::Result& seen, const Vec3& from_m) const noexcept {
    const Vec3& normal = seen.signed_distance.normal_in_world;
    return {{normal, dot(normal, from_m) - seen.signed_distance.distance_m + clearance_m_},
            seen.speed_m_per_s};
  }
  static bool isSamePiece(const StandoffCut& a, const StandoffCut& b) noexcept {
    return dot(a.half_space.normal, b.half_space.normal) > kSamePiece;
  }

  /// Looks for the nearest piece of the surface, and for the others that held the proxy. Returns whether
  /// there is any.
  bool lookFromProxy(int& looks) noexcept {
    const SurfaceDistance::Result& seen = surface_.look(proxy_);
    ++looks;
    if (!seen.found()) return false;
    memory_.frame = surface_.frame();
    memory_.model = surface_.model();
    memory_.age_s = surface_.age_s();
    memory_.from_m = proxy_;
    memory_.surface_m = seen.signed_distance.distance_m;
    const std::array<StandoffCut, StandoffMemory::kMaxCuts> before = memory_.cuts;
    const std::array<double, StandoffMemory::kMaxCuts> pushes = multipliers_;
    const std::size_t count = memory_.count;
    memory_.cuts[0] = cutOf(seen, proxy_);
    memory_.count = 1;
    for (std::size_t k = 0; k < count && memory_.count < StandoffMemory::kMaxCuts; ++k) {
      if (!(pushes[k] > 0) || isSamePiece(before[k], memory_.cuts[0])) continue;
      ++looks;
      lookAgain(before[k]);
    }
    return true;
  }

  /// Keeps a piece that held the proxy beside those that do, if it is still there.
  void lookAgain(const StandoffCut& before) noexcept {
    Vec3 away;
    for (std::size_t k = 0; k < memory_.count; ++k) away += memory_.cuts[k].half_space.normal;
    const double length = norm(away);
    if (!(length > 0)) return;
    const Vec3 from = proxy_ + (kProbe_m / length) * away;
    const SurfaceDistance::Result& seen = surface_.look(from);
    if (!seen.found()) return;
    const StandoffCut cut = cutOf(seen, from);
    if (isSamePiece(cut, before)) memory_.cuts[memory_.count++] = cut;
  }

  /// Goes on with what was seen last, for some frames and while it holds the HIP.
  void holdWithoutSurface() noexcept {
    memory_.model = 0;
    const bool recent = memory_.frame != 0 && surface_.frame() - memory_.frame <= kHeldFrames;
    bool holds = false;
    for (std::size_t k = 0; k < memory_.count; ++k)
      holds = holds || memory_.cuts[k].half_space.room_m(hip_) < 0;
    if (!recent || !holds) memory_.count = 0;
    for (std::size_t k = 0; k < memory_.count; ++k) memory_.cuts[k].speed_m_per_s = 0;
    step(std::numeric_limits<double>::infinity());
  }

  /// Finds the place nearest to the HIP that the cuts allow.
  void project() noexcept {
    std::array<HalfSpace, StandoffMemory::kMaxCuts> half_spaces;
    for (std::size_t k = 0; k < memory_.count; ++k) half_spaces[k] = memory_.cuts[k].half_space;
    multipliers_ = {};
    projectOnto(std::span(half_spaces).first(memory_.count), hip_, aim_,
                std::span(multipliers_).first(memory_.count));
  }

  /// Moves the proxy towards that place. Returns how far it moved.
  double step(double max_m) noexcept {
    project();
    const double length_m = norm(aim_ - proxy_);
    proxy_ = length_m <= max_m ? aim_ : proxy_ + (max_m / length_m) * (aim_ - proxy_);
    return std::min(length_m, max_m);
  }

  StandoffPlace place() const noexcept {
    StandoffPlace place;
    double pushed_m = 0;
    double nearest_m = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < memory_.count; ++k) {
      const StandoffCut& cut = memory_.cuts[k];
      pushed_m += multipliers_[k];
      place.speed_m_per_s += multipliers_[k] * cut.speed_m_per_s;
      const double room_m = cut.half_space.room_m(hip_);
      if (room_m < nearest_m) {
        nearest_m = room_m;
        place.region.normal_in_world = cut.half_space.normal;
      }
    }
    place.region.proxy_m_in_world = proxy_;
    if (pushed_m > 0 && memory_.count > 0) {
      place.speed_m_per_s /= pushed_m;
      place.region.depth_m = norm(proxy_ - hip_);
      if (place.region.depth_m > 0)
        place.region.normal_in_world = (1 / place.region.depth_m) * (proxy_ - hip_);
    } else {
      place.speed_m_per_s = 0;
      place.region.proxy_m_in_world = hip_;
      if (surface_.isAvailable())
        place.region.room_m = std::min(nearest_m, surface_.range_m() - clearance_m_);
    }
    return place;
  }

  LiveSurface& surface_;
  const double clearance_m_;
  const RegionMemory& region_;
  const Vec3 hip_;
  const Vec3 motion_;  ///< of the HIP since the last tick
  Vec3 proxy_;
  Vec3 aim_;
  StandoffMemory& memory_;
  std::array<double, StandoffMemory::kMaxCuts> multipliers_{};
};

}  // namespace

LiveSurface::LiveSurface(const Scene& scene, bool law_models_it, double shell_m, double age_s,
                         double clearance_m) noexcept
    : frame_(scene.frame), model_(scene.model), age_s_(age_s), range_m_(clearance_m + kAhead_m) {
  if (law_models_it && scene.has_surface) surface_.emplace(scene, shell_m, age_s);
}

const SurfaceDistance::Result& LiveSurface::look(const Vec3& place_m) noexcept {
  if (looked_ && place_m == looked_from_m_) return result_;
  looked_ = true;
  looked_from_m_ = place_m;
  result_ = surface_->at(place_m, range_m_);
  return result_;
}

StandoffPlace followStandoff(LiveSurface& surface, double clearance_m, const RegionMemory& region,
                             const Vec3& hip_m, const Vec3& motion_m, const Vec3& from_m,
                             StandoffMemory& memory) noexcept {
  return Follower(surface, clearance_m, region, hip_m, motion_m, from_m, memory).follow();
}

}  // namespace hapticd::rt
