// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "rt/parameters.h"
#include "tools/hapticbench/bench_scene.h"
#include "tools/lib/parts/is.h"

namespace hapticd::tools {

/// How much the force on a still hand on a still surface changes from frame to frame.
struct ForceNoise {
  double median_n = 0;    ///< standard deviation of the force in the last 2/3 of the frames, over the sites
  double largest_n = 0;   ///< the same, largest
  std::size_t sites = 0;  ///< where the law gave a force at all
  double nearest_m = 0;   ///< depth of the nearest site
  double farthest_m = 0;  ///< and of the farthest
};
auto fieldsOf(Is<ForceNoise> auto& noise) {
  auto& [median, largest, sites, nearest, farthest] = noise;
  return std::tie(median, largest, sites, nearest, farthest);
}

/// A position on a surface at rest in a sequence.
struct StillSite {
  std::size_t sequence = 0;
  rt::Vec3 surface_m_in_world;
  rt::Vec3 normal_in_world;  ///< towards the camera
};

/// The positions of a sequence, the nearest to the camera first, at most `count`: all that a law reads around
/// them is measured in nearly all frames, hardly changes, is nearly flat and faces the camera within 45
/// degrees.
std::vector<StillSite> stillSites(const std::vector<BenchSequence>& sequences, std::size_t sequence,
                                  std::size_t count);

/// FNV-1a over all frames, as 16 hexadecimal digits: shows whether two sweeps used the same.
std::string digestOf(const std::vector<BenchSequence>& sequences);

/// Measures the force noise of laws at still sites.
/// Thread: one.
class NoiseProbe {
 public:
  NoiseProbe(std::vector<BenchSequence> sequences, std::size_t sites_per_sequence);

  /// `h_m`: where the HIP is held along the normal of the surface.
  ForceNoise measure(const rt::LiveParameters& parameters, double h_m) const;

  const std::vector<StillSite>& sites() const { return sites_; }
  const std::vector<BenchSequence>& sequences() const { return sequences_; }

 private:
  double deviation_n(const rt::LiveParameters& parameters, const StillSite& site, double h_m) const;

  std::vector<BenchSequence> sequences_;
  std::vector<StillSite> sites_;
};

}  // namespace hapticd::tools
