// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "rt/forbidden_region.h"
#include "rt/half_spaces.h"
#include "rt/scene.h"
#include "rt/surface_distance.h"
#include "rt/vec3.h"

/// Stand-offs: forbidden regions that are a layer over the live surface.
namespace hapticd::rt {

/// The live surface during one tick, as stand-offs look at it.
/// Thread: one.  RT: safe.
class LiveSurface {
 public:
  /// `law_models_it`: the law is `surface`; otherwise, or where the scene has no surface, nothing is seen.
  /// `age_s`: see LawInput::frame_age_s. `clearance_m`: the largest of all stand-offs.
  LiveSurface(const Scene& scene, bool law_models_it, double shell_m, double age_s,
              double clearance_m) noexcept;

  bool isAvailable() const noexcept { return surface_.has_value(); }
  /// Looks from a place; the same place again costs nothing.
  const SurfaceDistance::Result& look(const Vec3& place_m) noexcept;
  /// Farthest surface that look() finds.
  double range_m() const noexcept { return range_m_; }
  double pitch_m(const Vec3& place_m) const noexcept { return surface_->pitch_m(place_m); }
  std::uint64_t frame() const noexcept { return frame_; }
  std::uint64_t model() const noexcept { return model_; }
  double age_s() const noexcept { return age_s_; }

 private:
  std::optional<SurfaceDistance> surface_;
  std::uint64_t frame_ = 0;
  std::uint64_t model_ = 0;
  double age_s_ = 0;
  double range_m_ = 0;
  bool looked_ = false;
  Vec3 looked_from_m_;
  SurfaceDistance::Result result_;
};

/// A piece of the surface that holds the proxy of a stand-off, as one look saw it.
struct StandoffCut {
  HalfSpace half_space;      ///< the places that are `clearance` in front of the piece
  double speed_m_per_s = 0;  ///< of the surface along its normal
};

/// What a stand-off keeps from one tick to the next, beside RegionMemory.
struct StandoffMemory {
  static constexpr std::size_t kMaxCuts = 3;  ///< three planes meet in a corner

  std::array<StandoffCut, kMaxCuts> cuts;
  std::size_t count = 0;
  std::uint64_t frame = 0;  ///< depth frame in which the surface was seen last; 0: none
  std::uint64_t model = 0;  ///< scene of the last look; 0: it saw nothing
  double age_s = 0;         ///< LiveSurface::age_s() then
  Vec3 from_m;              ///< place of the last look, next to the proxy
  double surface_m = 0;     ///< from there to the surface
  /// What the hand has put into the spring beyond the energy in it, 0..1e-6: may be given back, see
  /// followStandoff().
  double spare_j = 0;
};
static_assert(std::is_trivially_copyable_v<StandoffMemory>);

/// The HIP and a stand-off in a tick.
struct StandoffPlace {
  RegionPlace region;
  double speed_m_per_s = 0;  ///< of the boundary along the normal
};

/// Moves the proxy of a stand-off along the surface, in steps shorter than the distance from it. Where the
/// surface is hollow, up to three pieces of it hold the proxy; each is looked for anew, because beyond the
/// edge of a body there is none.
///
/// A tick begins with what the last one saw, moved with the surface, and looks again from where that leads,
/// so that it mostly takes one look. Where the surface has no measurement, what was seen last holds for some
/// frames.
///
/// The surface is interpolated, in single precision, so its distance and normal agree only nearly. So that
/// this gives the hand no energy, the proxy moves only to places that a look has found allowed, and that put
/// no more energy into the spring than its moves before took out, as long as the surface is the same.
/// `region`: of this stand-off, at the last tick; `from_m`: see followShape(). RT: safe.
StandoffPlace followStandoff(LiveSurface& surface, double clearance_m, const RegionMemory& region,
                             const Vec3& hip_m, const Vec3& motion_m, const Vec3& from_m,
                             StandoffMemory& memory) noexcept;

}  // namespace hapticd::rt
