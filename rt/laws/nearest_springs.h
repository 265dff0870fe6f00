// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "rt/base/parameters.h"
#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"
#include "rt/laws/force_law.h"
#include "rt/scene/scene.h"
#include "rt/scene/search_kernel.h"

namespace hapticd::rt {

/// Working memory of a search together with hints from the previous search of the same scene. The hints make
/// a search faster; they change a force by rounding at most, because points may be found and summed in a
/// different order.
/// Thread: one.
class SearchMemory {
 public:
  /// `point_capacity`: capacity of the scenes to be searched.  RT: not safe (allocates).
  explicit SearchMemory(std::size_t point_capacity);

  /// Returns empty arrays for the results of a search; the next search overwrites them.  RT: safe.
  Candidates candidates() noexcept { return {distance_squared_m2_.get(), pixel_.get(), 0}; }
  /// Returns working memory for the same number of points.  RT: safe.
  WorkVector* work() noexcept { return work_.get(); }

  /// Hints from the previous search.
  struct Guess {
    Vec3 last_hip_m_in_world;
    double last_radius_m = 0;      ///< a radius that held N_max points or was too small; 0: no search yet
    std::uint64_t free_model = 0;  ///< number of the scene that free_radius_m refers to
    Vec3 free_centre_m_in_world;
    double free_radius_m = 0;  ///< no point is nearer to free_centre than this
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

/// Computes the force of the paper's law, eq. (6)-(11): the mean of springs k_s (D_thresh - s) from the N_max
/// nearest of the points within D_thresh of the HIP, or from all of them if they are fewer, or zero if they
/// are fewer than N_min. Points are chosen and forces computed from exact (double precision) positions. Among
/// points at the same distance as the N_max-th, those first in image order (row by row) are chosen. At a
/// point that coincides with the HIP (V = 0 within 1e-9 m, eq. 10 undefined) the term is zero, but the point
/// counts in N.
/// `hip_m_in_world`: finite. The scene must cover the ball of radius D_thresh around it (Scene::covers).
/// RT: safe.  Cost: bounded by the points of the scene; typically about 1.3 N_max points plus the rows of
/// voxels that their ball meets.
ForceSample nearestSprings(const Scene& scene, const Vec3& hip_m_in_world, const SpringParameters& parameters,
                           SearchMemory& memory) HAPTICD_RT;

}  // namespace hapticd::rt
