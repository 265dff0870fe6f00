// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/cameras/camera_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>

#include "config/law_choice.h"
#include "rt/depth_model.h"
#include "rt/law_table.h"
#include "tools/hapticbench/accuracy/force_error.h"
#include "tools/lib/offline/offline_box.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::tools {
namespace {

constexpr double kAbove_m = 0.01;
constexpr double kStep_m = 0.001;
constexpr double kBall_m = 0.05;
constexpr int kPlaces = 12;
const char* const kKinect = "Kinect v1";

/// A surface in front of a camera: its image, and places on it.
struct Surface {
  DepthAt depth;
  std::function<rt::Vec3(int place)> at_m_in_camera;
  std::function<rt::Vec3(int place)> normal;  ///< towards the free side
};

Surface plane(const rt::DepthModelParameters& camera, double distance_m, double tilt_rad) {
  return {.depth = tiltedPlane(camera, distance_m, tilt_rad),
          .at_m_in_camera =
              [=](int place) {
                const double spacing_m = 0.1 * distance_m;
                const double x = spacing_m * (place % 4 - 1.5);
                const double y = spacing_m * (place / 4 - 1);
                return rt::Vec3{x, y, -distance_m + y * std::tan(tilt_rad)};
              },
          .normal =
              [=](int) {
                return rt::Vec3{0, -std::sin(tilt_rad), std::cos(tilt_rad)};
              }};
}

/// A ball whose nearest point is at the distance, with a wall behind it.
Surface ballBefore(const rt::DepthModelParameters& camera, double distance_m, double radius_m,
                   double wall_m) {
  const rt::Vec3 centre{0, 0, -distance_m - radius_m};
  const auto outward = [](int place) {
    const double from_axis = 0.5 * (place % 6 + 1) / 6;
    const double turn = (place / 6 + place % 6) * std::numbers::pi / 3;
    return rt::Vec3{std::sin(from_axis) * std::cos(turn), std::sin(from_axis) * std::sin(turn),
                    std::cos(from_axis)};
  };
  return {.depth =
              [front = ball(camera, centre, radius_m), wall_m](double column, double row) {
                const double depth = front(column, row);
                return depth > 0 ? depth : wall_m;
              },
          .at_m_in_camera = [=](int place) { return centre + radius_m * outward(place); },
          .normal = outward};
}

/// Pushes the HIP along the normal, and hands over each force with the true one from `from_m` to `to_m` deep.
void push(OfflineBox& box, const Surface& surface, double from_m, double to_m,
          const std::function<void(const rt::Vec3& force_n, const rt::Vec3& truth_n)>& take) {
  for (int place = 0; place < kPlaces; ++place) {
    const rt::Vec3 start = surface.at_m_in_camera(place);
    const rt::Vec3 normal = surface.normal(place);
    box.core().release();
    const int steps = static_cast<int>(std::lround((kAbove_m + to_m) / kStep_m));
    for (int step = 0; step <= steps; ++step) {
      const double deep_m = step * kStep_m - kAbove_m;
      const rt::Vec3 force_n = box.lawForce(start - deep_m * normal).force_n_in_world;
      if (deep_m < from_m - kStep_m / 2) continue;
      take(force_n, deep_m * box.parameters().springs.stiffness_n_per_m * normal);
    }
  }
}

/// Pushes into a surface as the camera shows it in `frames` frames, each with another noise.
void pushInto(const Surface& surface, const rt::DepthModelParameters& camera, rt::ForceLaw law, int frames,
              double from_m, double to_m,
              const std::function<void(const rt::Vec3& force_n, const rt::Vec3& truth_n)>& take) {
  rt::DepthModelParameters standing = camera;
  standing.noise.standing_share = 1;
  for (int seed = 1; seed <= frames; ++seed) {
    const auto frame = frameOf(standing, surface.depth, static_cast<std::uint32_t>(seed));
    rt::GridParameters grid;
    grid.point_capacity = static_cast<int>(rt::kMaxFramePixels);
    OfflineBox box(standing, {}, grid);
    box.parameters().law = law;
    box.show(*frame);
    push(box, surface, from_m, to_m, take);
  }
}

CameraError errorOf(const NamedCamera& named, double distance_m, rt::ForceLaw law, int frames) {
  constexpr double kFrom_m = 0.005;
  constexpr double kTo_m = 0.02;
  constexpr double kTilt_rad = 30 * std::numbers::pi / 180;
  const rt::DepthModelParameters& camera = named.camera;
  CameraError error{
      .camera = named.name,
      .distance_m = distance_m,
      .law = std::string(config::nameOf(law)),
      .sigma_m = rt::noiseOfPixel_m(camera, distance_m),
      .plane_m = {},
      .ball_m = {},
      .expected_m = config::expectedError_m(law, false, config::asSeenBy(camera, distance_m).noise_m)};
  const double stiffness_n_per_m = rt::SpringParameters{}.stiffness_n_per_m;
  const auto into = [&](const Surface& surface, Spread& spread) {
    pushInto(surface, camera, law, frames, kFrom_m, kTo_m,
             [&](const rt::Vec3& force_n, const rt::Vec3& truth_n) {
               spread.add(norm(force_n - truth_n) / stiffness_n_per_m);
             });
  };
  into(plane(camera, distance_m, 0), error.plane_m);
  into(plane(camera, distance_m, kTilt_rad), error.plane_m);
  into(ballBefore(camera, distance_m, kBall_m, distance_m + 0.3), error.ball_m);
  return error;
}

/// A camera and the distances at which it is measured.
struct Range {
  NamedCamera camera;
  std::vector<double> distances_m;
};

std::vector<Range> ranges() {
  return {{{kKinect, kinectWithNoise()}, {0.6, 0.8, 1, 1.5}},
          {{"D405 848x480", stereoCamera(848, 480, 87, 0.018, 1e-4, 0.07, 1.0)}, {0.15, 0.2, 0.3, 0.5}},
          {{"D435 424x240", stereoCamera(424, 240, 90, 0.050, 1e-3, 0.2, 4.0)}, {0.3, 0.5, 0.7}},
          {{"D435 848x480", stereoCamera(848, 480, 90, 0.050, 1e-4, 0.2, 4.0)}, {0.3, 0.5, 0.7, 1}},
          {{"D435 1280x720", stereoCamera(1280, 720, 90, 0.050, 1e-4, 0.2, 4.0)}, {0.3, 0.5, 0.7, 1}},
          {{"Gemini 1280x800", stereoCamera(1280, 800, 90, 0.050, 1e-3, 0.2, 4.0)}, {0.3, 0.5, 0.7, 1}},
          {{"Femto Mega 640x576", timeOfFlightCamera(640, 576)}, {0.5, 1, 1.5, 2}}};
}

std::vector<NearError> nearErrors(int frames) {
  const rt::DepthModelParameters d405 = stereoCamera(848, 480, 87, 0.018, 1e-4, 0.07, 1.0);
  std::vector<NearError> errors;
  const auto measure = [&](const std::string& scene, double distance_m, const Surface& surface,
                           double deep_m) {
    NearError error{.scene = scene, .distance_m = distance_m, .error_jnd = {}};
    pushInto(surface, d405, rt::ForceLaw::surface, frames, deep_m, deep_m,
             [&error](const rt::Vec3& force_n, const rt::Vec3& truth_n) {
               error.error_jnd.add(norm(force_n - truth_n) / justNoticeableDifference_n(norm(truth_n)));
             });
    errors.push_back(error);
  };
  constexpr double kSmallBall_m = 0.01;
  for (const double distance_m : {0.1, 0.2, 0.3}) {
    measure("plane", distance_m, plane(d405, distance_m, 0), 0.008);
  }
  for (const double distance_m : {0.1, 0.15}) {
    measure("ball of 20 mm", distance_m,
            ballBefore(d405, distance_m - kSmallBall_m, kSmallBall_m, distance_m + 0.06), 0.002);
  }
  return errors;
}

}  // namespace

double CameraError::rms_m() const {
  Spread all = plane_m;
  all.add(ball_m);
  return all.rms();
}

CameraErrors measureCameraErrors(int frames, const std::function<void(const std::string&)>& progress) {
  CameraErrors errors;
  for (const Range& range : ranges()) {
    if (progress) progress("errors of " + range.camera.name);
    for (const double distance_m : range.distances_m) {
      for (const rt::ForceLawRow& law : rt::kForceLaws) {
        errors.rows.push_back(errorOf(range.camera, distance_m, law.law, frames));
      }
    }
  }
  if (progress) progress("small things near a camera");
  errors.near = nearErrors(frames);
  return errors;
}

std::vector<Requirement> requirementsOf(const CameraErrors& errors) {
  const std::string surface(config::nameOf(rt::ForceLaw::surface));
  double plane_of_kinect = 0;
  double ball_of_kinect = 0;
  for (const CameraError& row : errors.rows) {
    if (row.camera != kKinect || row.law != surface) continue;
    plane_of_kinect = std::max(plane_of_kinect, row.planeSigmas());
    ball_of_kinect = std::max(ball_of_kinect, row.ballSigmas());
  }
  const auto others = [&surface](const CameraError& row) {
    return row.law == surface && row.camera != kKinect;
  };
  const auto name = [](const CameraError& row) {
    return fmt::format("{} at {} m", row.camera, row.distance_m);
  };
  // Less than half of the smallest force that a hand notices, at 500 N/m.
  constexpr double kUnnoticed_m = 1e-4;
  const auto limited = [&](const std::string& text, double (CameraError::*figure)() const, double limit) {
    const RowRequirement<CameraError> requirement{text, [=](const CameraError& row) {
                                                    const bool counts =
                                                        (row.*figure)() * row.sigma_m > kUnnoticed_m;
                                                    return figureIf(counts, (row.*figure)(), limit);
                                                  }};
    return checked(surface, requirement, errors.rows, others, name);
  };
  const RowRequirement<NearError> near{"near a D405: RMS error, JND", [](const NearError& row) {
                                         return figureIf(true, row.error_jnd.rms(), 1);
                                       }};
  return {limited("planes: RMS errors above 0.1 mm over the noise of a pixel; limit: a Kinect's",
                  &CameraError::planeSigmas, plane_of_kinect),
          limited("balls: RMS errors above 0.1 mm over the noise of a pixel; limit: a Kinect's",
                  &CameraError::ballSigmas, ball_of_kinect),
          checked(
              surface, near, errors.near, [](const NearError&) { return true; },
              [](const NearError& row) { return fmt::format("{} at {} m", row.scene, row.distance_m); })};
}

}  // namespace hapticd::tools
