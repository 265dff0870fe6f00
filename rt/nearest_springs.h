// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "rt/force_law.h"
#include "rt/parameters.h"
#include "rt/realtime_safe.h"
#include "rt/scene.h"
#include "rt/search_kernel.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// Working memory of a search, and what the last search of the same thread learned. It makes searches faster;
/// it changes a force by rounding at most, as the points are found, and summed, in another order. Thread:
/// one.
class SearchMemory {
 public:
  /// `point_capacity`: of the scenes to be searched.  RT: not safe (allocates).
  explicit SearchMemory(std::size_t point_capacity);

  /// Room for what a search finds; the next search writes over it.  RT: safe.
  Candidates candidates() noexcept { return {distance_squared_m2_.get(), pixel_.get(), 0}; }
  /// Working memory for as many points.  RT: safe.
  WorkVector* work() noexcept { return work_.get(); }

  /// What the last search learned.
  struct Guess {
    Vec3 last_hip_m_in_world;
    double last_radius_m = 0;      ///< that held N_max points, or was not enough; 0: no search yet
    std::uint64_t free_model = 0;  ///< the scene that free_radius_m is of
    Vec3 free_centre_m_in_world;
    double free_radius_m = 0;  ///< no point is nearer to free_centre
  };
  const Guess& guess() const noexcept { return guess_; }
  void setGuess(const Guess& guess) noexcept { guess_ = guess; }

 private:
  friend ForceSample nearestSprings(const Scene& scene, const Vec3& hip_m_in_world,
                                    const SpringParameters& parameters, SearchMemory& memory) HAPTICD_RT;
  friend class NearestSearch;

  std::unique_ptr<float[]> distance_squared_m2_;
  std::unique_ptr<std::uint32_t[]> pixel_;
  std::unique_ptr<std::uint32_t[]> boundary_pixel_;
  struct Ranked {
    double distance_squared_m2;
    std::uint32_t pixel;
  };
  std::unique_ptr<Ranked[]> ranked_;
  std::unique_ptr<WorkVector[]> work_;

  Guess guess_;
};

/// Force of the paper's law, eq. (6)-(11): the mean of springs k_s (D_thresh - s) from the N_max nearest of
/// the points within D_thresh of the HIP, or from all of them, or none if they are fewer than N_min. Points
/// are chosen and forces computed from exact (double precision) positions. Where the N_max-th and further
/// points are equally far, pixels that come first in the image, row by row, are chosen. Where the HIP
/// coincides with a point (V = 0 within 1e-9 m, eq. 10 is undefined there) that point's term is zero, and the
/// point still counts in N. `hip_m_in_world`: finite. The scene must cover the ball of D_thresh around it
/// (Scene::covers). RT: safe. Cost: bounded by the points of the scene; typically by about 1.3 N_max points
/// and the rows of voxels that their ball meets.
ForceSample nearestSprings(const Scene& scene, const Vec3& hip_m_in_world, const SpringParameters& parameters,
                           SearchMemory& memory) HAPTICD_RT;

}  // namespace hapticd::rt
