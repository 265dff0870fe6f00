// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "config/settings/law_choice.h"
#include "rt/base/clock.h"
#include "rt/depth/depth_model.h"
#include "rt/laws/law_table.h"
#include "rt/modelling/scene_builder.h"
#include "tools/hapticbench/cost.h"
#include "tools/hapticbench/engine/measures.h"
#include "tools/hapticbench/engine/study.h"
#include "tools/lib/offline/offline_box.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::tools {
namespace {

/// Times of modelling one frame of a camera, medians in nanoseconds.
struct CameraCost {
  std::string camera;
  double distance_m = 0;
  int pixels_in_reach = 0;       ///< pixels whose rays meet the ball that the HIP can reach
  double reach_ns = 0;           ///< the points in reach, for the paper's law
  double surface_ns = 0;         ///< the visible surface in reach, for the law `surface`
  double tree_ns = 0;            ///< nanoflann's tree of all points
  double kinect_distance_m = 0;  ///< of the Kinect that it is compared with
  int kinect_pixels_in_reach = 0;
  double kinect_reach_ns = 0;
  double kinect_surface_ns = 0;

  double timesCheaperThanTree() const { return tree_ns / reach_ns; }
  /// Cost per pixel in reach relative to the Kinect's.
  double reachPerPixel() const { return perPixel(reach_ns, kinect_reach_ns); }
  double surfacePerPixel() const { return perPixel(surface_ns, kinect_surface_ns); }

 private:
  double perPixel(double ns, double kinect_ns) const {
    return ns / pixels_in_reach / (kinect_ns / kinect_pixels_in_reach);
  }
};

std::vector<NamedCamera> cameras() {
  return {{"Kinect v1 640x480", kinectWithNoise()},
          {"D435 424x240", stereoCamera(424, 240, 90, 0.050, 1e-3, 0.2, 2.2)},
          {"D435 848x480", stereoCamera(848, 480, 90, 0.050, 1e-3, 0.2, 2.2)},
          {"D435 1280x720", stereoCamera(1280, 720, 90, 0.050, 1e-3, 0.2, 2.2)},
          {"D405 1280x720", stereoCamera(1280, 720, 87, 0.018, 1e-4, 0.07, 2.0)},
          {"Gemini 1280x800", stereoCamera(1280, 800, 90, 0.050, 1e-3, 0.2, 2.2)}};
}

/// A frame of one camera and everything that models it.
class Modelled {
 public:
  Modelled(const rt::DepthModelParameters& camera, double distance_m)
      : hip_m_{0, 0, -distance_m},
        frame_(frameOf(camera, tiltedPlane(camera, distance_m, 0.3), /*seed=*/1)),
        model_(camera, {}),
        builder_(model_, grid_),
        storage_(builder_.shape(), builder_.pointCapacity(), model_) {
    storage_.attachTo(scene_);
  }

  /// Times the model of the next frame for a law.
  double time_ns(rt::ForceLaw law) {
    rt::LiveParameters parameters;
    parameters.law = law;
    const rt::SceneNeeds needs = rt::SceneNeeds::of(parameters);
    ++frame_->sequence;
    frame_->arrival_ns += kPeriod_ns;
    const std::int64_t begin_ns = rt::monotonicNow_ns();
    builder_.build(*frame_, hip_m_, rt::reachOfModel_m(needs, grid_), scene_, needs);
    return static_cast<double>(rt::monotonicNow_ns() - begin_ns);
  }
  int pixelsInReach() const {
    const rt::SceneNeeds needs;
    const rt::PixelWindow window = model_.pixelsOfBall(hip_m_, rt::reachOfModel_m(needs, grid_));
    return (window.column_last - window.column_first + 1) * (window.row_last - window.row_first + 1);
  }
  const rt::DepthFrame& frame() const { return *frame_; }
  const rt::Vec3& hip_m() const { return hip_m_; }

 private:
  static constexpr std::int64_t kPeriod_ns = 33'333'333;

  rt::Vec3 hip_m_;
  std::unique_ptr<rt::DepthFrame> frame_;
  rt::DepthModel model_;
  rt::GridParameters grid_{.point_capacity = static_cast<int>(rt::kMaxFramePixels)};
  rt::SceneBuilder builder_;
  rt::SceneStorage storage_;
  rt::Scene scene_;
};

/// Times things alternately, so that other load falls on all of them alike; returns the medians.
template <std::size_t N>
std::array<double, N> medians(int repetitions, const std::array<std::function<double()>, N>& timed) {
  std::array<std::vector<double>, N> samples;
  for (int i = 0; i < repetitions; ++i) {
    for (std::size_t j = 0; j < N; ++j) samples[j].push_back(timed[j]());
  }
  std::array<double, N> result{};
  for (std::size_t j = 0; j < N; ++j) result[j] = quantile(std::move(samples[j]), 0.5);
  return result;
}

double treeTime_ns(const rt::DepthModelParameters& camera, const Modelled& modelled) {
  const auto kinds = libraries();
  const auto whole = std::ranges::find(kinds, "nanoflann", &ContenderKind::name);
  const auto tree = whole->make(camera);
  constexpr int kTrees = 3;
  std::vector<double> samples;
  for (int i = 0; i < kTrees; ++i) {
    const std::int64_t begin_ns = rt::monotonicNow_ns();
    tree->model(modelled.frame(), modelled.hip_m());
    samples.push_back(static_cast<double>(rt::monotonicNow_ns() - begin_ns));
  }
  return quantile(std::move(samples), 0.5);
}

CameraCost costOf(const NamedCamera& named, double distance_m, int repetitions) {
  const rt::DepthModelParameters& camera = named.camera;
  const rt::DepthModelParameters kinect = kinectWithNoise();
  CameraCost cost{.camera = named.name, .distance_m = distance_m};
  cost.kinect_distance_m =
      std::clamp(distance_m * kinect.fx_px / camera.fx_px, kinect.near_m + 0.02, kinect.far_m - 0.2);
  Modelled reach(camera, distance_m);
  Modelled surface(camera, distance_m);
  Modelled other_reach(kinect, cost.kinect_distance_m);
  Modelled other_surface(kinect, cost.kinect_distance_m);
  cost.pixels_in_reach = reach.pixelsInReach();
  cost.kinect_pixels_in_reach = other_reach.pixelsInReach();
  using rt::ForceLaw;
  const auto times = medians<4>(repetitions, {[&] { return reach.time_ns(ForceLaw::nearest_springs); },
                                              [&] { return other_reach.time_ns(ForceLaw::nearest_springs); },
                                              [&] { return surface.time_ns(ForceLaw::surface); },
                                              [&] { return other_surface.time_ns(ForceLaw::surface); }});
  cost.reach_ns = times[0];
  cost.kinect_reach_ns = times[1];
  cost.surface_ns = times[2];
  cost.kinect_surface_ns = times[3];
  cost.tree_ns = treeTime_ns(camera, reach);
  return cost;
}

/// Measures all cameras at the distances that lie in their range. `repetitions`: of each timed model.
std::vector<CameraCost> measureCameraCosts(int repetitions, const std::vector<double>& distances_m) {
  std::vector<CameraCost> costs;
  for (const NamedCamera& camera : cameras()) {
    for (const double distance_m : distances_m) {
      if (distance_m > camera.camera.near_m + 0.05) costs.push_back(costOf(camera, distance_m, repetitions));
    }
  }
  return costs;
}

std::vector<Limit> costLimits(const CameraCost& row) {
  constexpr double kFrom_m = 0.7;
  constexpr double kTimesCheaper = 300;
  constexpr double kPerPixel = 1.3;
  return {{"time of the reach over that of nanoflann's tree from 0.7 m on", row.distance_m >= kFrom_m,
           row.reach_ns / row.tree_ns, 1 / kTimesCheaper},
          {"reach: time per pixel over a Kinect's", true, row.reachPerPixel(), kPerPixel},
          {"surface: time per pixel over a Kinect's", true, row.surfacePerPixel(), kPerPixel}};
}

/// Errors of a law on surfaces that a camera sees with its own noise: the HIP is pushed 5 to 20 mm into a
/// plane that faces the camera, one turned by 30 degrees and a ball of 100 mm, and the force is compared with
/// that of a spring to the true surface. All of the noise stands still, which no law can average away.
struct CameraError {
  std::string camera;
  double distance_m = 0;
  std::string law;
  double sigma_m = 0;     ///< standard deviation of Z of a pixel there, rounding included
  Spread plane_m;         ///< error of the force over the stiffness, on both planes
  Spread ball_m;          ///< the same on the ball
  double expected_m = 0;  ///< RMS error that `auto` expects of that noise (config/settings/measured_laws.inc)

  double planeSigmas() const { return plane_m.rms() / sigma_m; }
  double ballSigmas() const { return ball_m.rms() / sigma_m; }
  double rms_m() const {
    Spread all = plane_m;
    all.add(ball_m);
    return all.rms();
  }
  /// RMS error over the one that `auto` expects.
  double byExpected() const { return rms_m() / expected_m; }
};

/// Error on small things near a camera of a baseline of 18 mm (RealSense D405), in just noticeable
/// differences: 8 mm deep in a plane and 2 mm in a ball of 20 mm.
struct NearError {
  std::string scene;
  double distance_m = 0;
  Spread error_jnd;
};

struct CameraErrors {
  std::vector<CameraError> rows;
  std::vector<NearError> near;
};

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
      take(force_n, deep_m * box.parameters().force.stiffness_n_per_m * normal);
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
      .law = std::string(nameOf(law)),
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

/// Measures all laws with each camera. `frames`: of each camera and scene, each with another noise.
CameraErrors measureCameraErrors(int frames) {
  CameraErrors errors;
  for (const Range& range : ranges()) {
    showProgress("errors of " + range.camera.name);
    for (const double distance_m : range.distances_m) {
      for (const rt::ForceLawRow& law : rt::kForceLaws) {
        errors.rows.push_back(errorOf(range.camera, distance_m, law.law, frames));
      }
    }
  }
  showProgress("small things near a camera");
  errors.near = nearErrors(frames);
  return errors;
}

/// No camera errs more in its own standard deviations than a Kinect v1 does under the law `surface`, and
/// small things near a camera are displayed to within one JND.
std::vector<Requirement> requirementsOf(const std::vector<CameraCost>& costs, const CameraErrors& errors) {
  // Less than half of the smallest force that a hand notices, at 500 N/m.
  constexpr double kUnnoticed_m = 1e-4;
  const std::string surface(nameOf(rt::ForceLaw::surface));
  double plane_of_kinect = 0;
  double ball_of_kinect = 0;
  for (const CameraError& row : errors.rows) {
    if (row.camera != kKinect || row.law != surface) continue;
    plane_of_kinect = std::max(plane_of_kinect, row.planeSigmas());
    ball_of_kinect = std::max(ball_of_kinect, row.ballSigmas());
  }
  const auto error_limits = [&](const CameraError& row) {
    const auto counts = [&row](double sigmas) { return sigmas * row.sigma_m > kUnnoticed_m; };
    return std::vector<Limit>{{"planes: RMS errors above 0.1 mm over the noise of a pixel; limit: a Kinect's",
                               counts(row.planeSigmas()), row.planeSigmas(), plane_of_kinect},
                              {"balls: RMS errors above 0.1 mm over the noise of a pixel; limit: a Kinect's",
                               counts(row.ballSigmas()), row.ballSigmas(), ball_of_kinect}};
  };
  const auto near_limits = [](const NearError& row) {
    return std::vector<Limit>{{"near a D405: RMS error, JND", true, row.error_jnd.rms(), 1}};
  };
  const auto all = [](const auto&, const std::string&) { return true; };
  const auto others = [](const CameraError& row, const std::string& law) {
    return row.law == law && row.camera != kKinect;
  };
  const auto name = [](const auto& row) { return fmt::format("{} at {} m", row.camera, row.distance_m); };
  const auto name_of_near = [](const NearError& row) {
    return fmt::format("{} at {} m", row.scene, row.distance_m);
  };
  std::vector<Requirement> list = checked({""}, costs, all, costLimits, name);
  for (const auto& more : {checked({surface}, errors.rows, others, error_limits, name),
                           checked({surface}, errors.near, all, near_limits, name_of_near)})
    list.insert(list.end(), more.begin(), more.end());
  return list;
}

Row costCells(const CameraCost& row) {
  return {{"/camera", "camera", 0, row.camera},
          {"/distance_m", "m", 1, row.distance_m},
          {"/pixels_in_reach", "pixels in reach", 0, static_cast<double>(row.pixels_in_reach)},
          {"/reach_ns", "reach ns", 0, row.reach_ns},
          {"/surface_ns", "surface ns", 0, row.surface_ns},
          {"/tree_ns", "tree ns", 0, row.tree_ns},
          {"/times_cheaper_than_tree", "tree/reach", 0, row.timesCheaperThanTree()},
          {"/kinect_distance_m", "Kinect at m", 2, row.kinect_distance_m},
          {"/reach_per_pixel", "reach per pixel/Kinect", 2, row.reachPerPixel()},
          {"/surface_per_pixel", "surface per pixel/Kinect", 2, row.surfacePerPixel()}};
}

Row errorCells(const CameraError& row) {
  constexpr double kMillimetres = 1000;
  return {{"/camera", "camera", 0, row.camera},
          {"/distance_m", "m", 2, row.distance_m},
          {"/law", "law", 0, row.law},
          {"/sigma_m", "pixel's noise mm", 2, row.sigma_m, kMillimetres},
          {"/error_m", "error mm", 2, row.rms_m(), kMillimetres},
          {"/plane_sigmas", "planes/noise", 2, row.planeSigmas()},
          {"/ball_sigmas", "ball/noise", 2, row.ballSigmas()},
          {"/expected_m", "expected mm", 2, row.expected_m, kMillimetres},
          {"/by_expected", "error/expected", 2, row.byExpected()}};
}

Row nearErrorCells(const NearError& row) {
  return {{"/scene", "scene", 0, row.scene},
          {"/distance_m", "m", 2, row.distance_m},
          {"/error_jnd", "error JND", 2, row.error_jnd.rms()}};
}

}  // namespace

StudyCommand camerasCommand(CLI::App& app) {
  struct Options {
    int frames = 200;
    int errors = 6;
    std::vector<double> distances_m{0.3, 0.5, 0.7, 1.0, 1.5};
  };
  const auto options = std::make_shared<Options>();
  StudyCommand command(app, "cameras", "cost of a depth frame and error of the laws with other cameras");
  command.quick("3 frames of each at 0.7 m, and errors with one noise", [options] {
    options->frames = 3;
    options->errors = 1;
    options->distances_m = {0.7};
  });
  command.onReport([options] {
    showProgress("cost");
    const std::vector<CameraCost> costs = measureCameraCosts(options->frames, options->distances_m);
    const CameraErrors errors = measureCameraErrors(options->errors);
    Report report;
    report.note("/frames", options->frames);
    report.table("rows", "one depth frame modelled, medians\n", rowsOf(costs, costCells));
    report.table("errors", "\nerror of the force over the stiffness, RMS\n", rowsOf(errors.rows, errorCells));
    report.table("near", "\nsmall things near a D405\n", rowsOf(errors.near, nearErrorCells));
    report.requirements(requirementsOf(costs, errors));
    return report;
  });
  return command;
}

}  // namespace hapticd::tools
