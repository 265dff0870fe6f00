// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "rt/depth/depth_frame.h"
#include "rt/depth/depth_model.h"
#include "tools/hapticbench/engine/laws.h"

namespace hapticd::tools {

/// A method to compute forces from depth frames, to be timed.
class Contender {
 public:
  Contender() = default;
  Contender(const Contender&) = delete;
  Contender& operator=(const Contender&) = delete;
  virtual ~Contender() = default;

  /// Models a frame for a HIP at that position; the frame stays valid until the next one.
  virtual void model(const rt::DepthFrame& frame, const rt::Vec3& hip_m) = 0;
  /// True if the model does not reach far enough to compute a force at that HIP.
  virtual bool needsModel(const rt::Vec3&) const { return false; }
  /// Called when the next HIP is unrelated to the previous one.
  virtual void release() {}
  /// Returns the force in newtons.
  virtual rt::Vec3 force_n(const rt::Vec3& hip_m) = 0;
};

/// A contender by name, created for every run.
struct ContenderKind {
  std::string name;
  std::function<std::unique_ptr<Contender>(const rt::DepthModelParameters& camera)> make;
  bool is_ours = false;
  LawSetting setting;  ///< of ours
  bool is_paper_law = false;
};

ContenderKind ours(const LawSetting& setting);

/// Brute force, and nanoflann's tree of the whole frame and of the points that the HIP can reach: all with
/// the paper's law and its parameters.
std::vector<ContenderKind> libraries();

inline constexpr double kFramesPerSecond = 30;
inline constexpr double kTicksPerSecond = 1000;

/// How long each frame and each force of a run took, nanoseconds, in the order of the run.
struct CostSamples {
  std::vector<std::int64_t> model_ns;  ///< all modelling that a frame caused
  std::vector<std::int64_t> force_ns;

  /// Keeps the faster time of each sample of two equal runs, which leaves out interruptions by other
  /// programs.
  void keepLeast(const CostSamples& again);
  void append(const CostSamples& more);
};

/// CPU cost of a law, microseconds of one core. All 0 where nothing was measured.
struct CpuCost {
  double model_median_us = 0;
  double model_mean_us = 0;
  double model_max_us = 0;
  double force_median_us = 0;
  double force_mean_us = 0;
  double force_p999_us = 0;
  double force_max_us = 0;

  static CpuCost of(const CostSamples& samples);
  /// Milliseconds of CPU time per second of use: 30 frames modelled and 1000 forces.
  double cpu_ms_per_s() const {
    return (kFramesPerSecond * model_mean_us + kTicksPerSecond * force_mean_us) / 1000;
  }
};

/// The time that the clock measures for an empty call: its own cost, nanoseconds.
std::int64_t clockCost_ns();

/// The highest speed of touchingPath(), m/s.
inline constexpr double kPathSpeed_m_per_s = 0.5;
inline constexpr double kPathRadius_m = 0.06;

/// A HIP that moves at 1 kHz around a point on a surface: in a circle and in and out, from 35 mm in
/// front of the surface to 15 mm behind it. Not faster than kPathSpeed_m_per_s, times `speed_up`. `inward`:
/// unit vector. `radius_m`: of the circle, at most kPathRadius_m.
std::vector<rt::Vec3> touchingPath(const rt::Vec3& surface_m, const rt::Vec3& inward, int ticks,
                                   double radius_m = kPathRadius_m, double speed_up = 1);

/// Depth frames that are shown in a loop, and the path of a HIP that touches what they show.
struct TimedScene {
  std::string name;
  rt::DepthModelParameters camera{};
  std::vector<std::shared_ptr<const rt::DepthFrame>> frames{};
  rt::Vec3 surface_m{};
  rt::Vec3 inward{};
  std::vector<rt::Vec3> path{};  ///< of the HIP, at 1 kHz; empty: touchingPath()
  bool unrelated = false;        ///< consecutive positions of the path are unrelated
};

/// The table and the sphere of bench_scene.h, and the recordings in the folder `recordings`, if there are
/// any. Errors: a recording that cannot be read, or that shows nothing within 2 m.
base::Result<std::vector<TimedScene>> timedScenes(const std::string& recordings);

/// A plane turned by 30 degrees with the harsher noise.
TimedScene slopeAt(double distance_m);

struct CostOptions {
  double seconds = 2;  ///< of motion, where the scene has no path of its own
  int repeats = 3;     ///< runs, of which the fastest of each sample counts
  int checks = 40;     ///< positions at which forces are compared with the reference; 0: none
};

/// The times of one contender on one scene or on several.
struct ContenderCost {
  ContenderKind kind;
  CostSamples samples;
  int models = 0;                    ///< in one run
  int contacts = 0;                  ///< ticks with a force
  double largest_difference_n = -1;  ///< from the reference, paper's law only; -1: not compared
};

/// The contenders in turn, frame by frame: each models the frame and computes the forces until the next one,
/// so that disturbances fall on all of them and none profits from what another left in the caches.
std::vector<ContenderCost> measureCosts(const TimedScene& scene, const std::vector<ContenderKind>& kinds,
                                        const CostOptions& options);

/// Adds the measurements on another scene, which must have the same kinds in the same order.
void addCosts(std::vector<ContenderCost>& sum, const std::vector<ContenderCost>& more);

/// Frames that are expensive to model or to search: all pixels in one ball (through a lens of 20000 pixels of
/// focal length), a wall at 0.42 m, a checkerboard and columns of two depths, and random raw values. The HIP
/// moves around what they show for a while and then jumps randomly.
std::vector<TimedScene> hardFrames();

/// The scene with a HIP that jumps between positions near what is measured, `ticks` times.
TimedScene scattered(TimedScene scene, int ticks);

/// The scene with a HIP at up to 1 m/s.
TimedScene fast(TimedScene scene, int ticks);

}  // namespace hapticd::tools
