// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "rt/base/vec3.h"
#include "rt/depth/depth_frame.h"
#include "tools/hapticbench/disparity.h"
#include "tools/hapticbench/engine/laws.h"
#include "tools/hapticbench/engine/measures.h"
#include "tools/hapticbench/engine/sequences.h"

namespace hapticd::tools {

/// Statistics of a pixel over a session, in raw disparities of its camera.
struct PixelStatistics {
  float mean = 0;
  float deviation = 0;      ///< standard deviation over the frames
  float drift = 0;          ///< mean of the second half less that of the first
  std::uint16_t valid = 0;  ///< frames with a measurement
  float farthest = 0;       ///< a fifth of its measurements are as far or farther
  float noise_scale = 1;    ///< the camera's noise at the mean relative to a Kinect's
  float drift_noise = 0;    ///< standard deviation of `drift` by the noise that the camera states
};

/// Returns the statistics of all pixels, in the order of a frame's image.
std::vector<PixelStatistics> pixelStatistics(const BenchSequence& session, const CameraDisparity& camera);

/// True where the pixel saw a surface at rest: nearly always measured, and within noise of its mean.
bool rests(const PixelStatistics& pixel, std::size_t frames);

/// A smooth surface at rest in a recording, known by a fit to the mean of all frames.
struct RestingSurface {
  DisparityQuadratic fit;
  double column = 0;  ///< of the middle
  double row = 0;
  int half_px = 0;          ///< the fit reaches that far to each side
  double size_m = 0;        ///< side of the square that was fitted
  double distance_m = 0;    ///< of the middle along the optical axis
  double residual_raw = 0;  ///< standard deviation of the mean image about the fit: the static pattern
  double fit_error_m = 0;   ///< standard error of the fit along the normal, RMS over the surface
};

struct RestingSurfaceOptions {
  std::vector<double> sizes_m{0.16, 0.32, 0.64};
  /// Between classes of distances within the camera's limits; the first and the last class have no other.
  std::vector<double> class_borders_m{0.1, 0.15, 0.25, 0.4, 0.75, 1.2, 1.6, 2.2, 3.2};
  int most_per_class = 2;  ///< surfaces of one size in one class of distances, which do not overlap
};

/// The flattest squares of each size and class of distances. `pixels`: of pixelStatistics().
std::vector<RestingSurface> restingSurfaces(std::span<const PixelStatistics> pixels, std::size_t frames,
                                            const CameraDisparity& camera,
                                            const RestingSurfaceOptions& options);

/// The class of a distance: how many of `borders_m` are not above it.
std::size_t distanceClassOf(double distance_m, std::span<const double> borders_m);

/// Standard error of a fit with `terms` terms to a square of so many pixels of a mean image, RMS over the
/// square, raw units: what of the static pattern it takes for the surface. `residual_raw`: standard
/// deviation about the fit. `correlation_px`: the pattern is white noise smoothed by a square of that side.
double fitError(double residual_raw, double pixels, int terms, double correlation_px);

/// One tick of a hand on a known surface.
struct StrokeTick {
  rt::Vec3 hip_m;
  rt::Vec3 true_force_n;  ///< of the spring to an ideal constraint; zero in front of the surface
  rt::Vec3 normal;        ///< out of the surface
  rt::Vec3 along;         ///< unit vector of the stroke; zero while it does not stroke
  bool presses = false;   ///< at full depth
};

/// The action of the hand 8 mm behind the surface.
enum class Handling : std::uint8_t { still, along_row, along_column };

/// The HIP waits 30 mm in front of the surface while the law sees its first frames, is pushed in 8 mm at
/// 0.1 m/s and strokes up to 100 mm at 0.1 m/s, no nearer to the fit's border than 25 mm, or stays there for
/// two seconds.
std::vector<StrokeTick> handleSurface(const RestingSurface& surface, const CameraDisparity& camera,
                                      Handling handling, double stiffness_n_per_m);

/// Errors of a law while a hand is on a known surface; only ticks at full depth count.
struct SurfaceError {
  std::vector<double> error_n;      ///< against the true force
  std::vector<double> along_n;      ///< along the stroke, of either sign
  std::vector<double> new_frame_n;  ///< change of the law's force at a new frame, HIP still
  std::size_t lost = 0;             ///< ticks with less than a tenth of the true force
  std::size_t zero = 0;             ///< of these, with no force at all
  double largest_true_n = 0;        ///< true force

  void add(const SurfaceError& other);
};

/// Compares the law's forces, tick by tick, with the true ones. `forces_n` and `new_frame` are as long as
/// `ticks`.
SurfaceError judgeSurface(std::span<const StrokeTick> ticks, std::span<const rt::Vec3> forces_n,
                          const std::vector<bool>& new_frame);

/// The errors of one law on one surface of a session.
SurfaceError handleWith(const std::string& law, const BenchSequence& session, const RestingSurface& surface,
                        const CameraDisparity& camera, Handling handling);

/// The background at rest, pixel by pixel in the order of a frame's image: the mean of the measurements that
/// are about the farthest, raw disparities; NaN where fewer than three tenths of the frames show it.
std::vector<float> restingBackground(const BenchSequence& session, std::span<const PixelStatistics> pixels,
                                     const CameraDisparity& camera);

/// A position on a resting surface in front of which something passes.
struct PassedPlace {
  DisparityQuadratic surface;  ///< of the background around it
  double column = 0;
  double row = 0;
  int half_px = 0;  ///< the square that a patch of 40 mm around it covers
  double distance_m = 0;
  SurfacePoint point;
  std::vector<bool> covered;  ///< frame by frame: something nearer covers a part of the square, or nothing is
                              ///< measured in most of it
};

/// Up to `most` positions, spread over the image, that something passes in two frames or more and that are in
/// sight for half a second.
std::vector<PassedPlace> passedPlaces(const BenchSequence& session, std::span<const float> background,
                                      const CameraDisparity& camera, int most);

/// The longest run of frames in which a position is not covered, the first of equal ones.
struct InSight {
  int first = 0;
  int frames = 0;
};
InSight longestInSight(const std::vector<bool>& covered);

/// True if a measured point of the frame is within `radius_m` of `centre_m` and more than `before_m` before
/// the surface there.
bool measuresNear(const rt::DepthFrame& frame, const CameraDisparity& camera, const PassedPlace& place,
                  const rt::Vec3& centre_m, double radius_m, double before_m);

/// One tick of a hand in front of which something passes.
struct PassingTick {
  rt::Vec3 force_n;
  rt::Vec3 true_n;        ///< zero for a HIP in front of the surface
  bool covered = false;   ///< something nearer covers the position, or did within the last fifth of a second
  bool left_out = false;  ///< something is measured within 20 mm of the HIP, which may touch it
};

/// Errors of a law at one position or several.
struct PassingError {
  std::size_t left_out = 0;
  Exceedance ghost;          ///< free hand: force over 0.1 N
  Exceedance ghost_covered;  ///< of these ticks, those while something passes
  Exceedance error;          ///< pressing hand, while something passes: error over 0.5 N
  Exceedance change;         ///< the same of the difference from the mean force while nothing passed
  Exceedance calm;           ///< that difference while nothing passes: the sensor's own noise
  void add(const PassingError& other);
};

/// The hand is free if true_n is zero at all ticks, else it presses.
PassingError judgePassing(const std::vector<PassingTick>& ticks);

/// A HIP that waits `before_m` (positive) in front of the surface at a position, or presses that far
/// (negative) behind it, while the session is played once forwards and once backwards.
PassingError passPlace(const std::string& law, const BenchSequence& session, const PassedPlace& place,
                       const CameraDisparity& camera, double before_m);

}  // namespace hapticd::tools
