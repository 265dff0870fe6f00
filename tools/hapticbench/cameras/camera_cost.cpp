// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/cameras/camera_cost.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>

#include "rt/clock.h"
#include "rt/scene_builder.h"
#include "tools/hapticbench/pareto/contender.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::tools {
namespace {

constexpr double kTilt_rad = 0.3;
constexpr std::uint32_t kSeed = 1;

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
  Modelled(const rt::DepthModelParameters& camera, double distance_m, rt::ModelExtent extent)
      : camera_(camera),
        hip_m_{0, 0, -distance_m},
        frame_(frameOf(camera, tiltedPlane(camera, distance_m, kTilt_rad), kSeed)),
        model_(camera, {}),
        grid_(gridOf(extent)),
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
  static rt::GridParameters gridOf(rt::ModelExtent extent) {
    rt::GridParameters grid;
    grid.extent = extent;
    grid.point_capacity = static_cast<int>(rt::kMaxFramePixels);
    return grid;
  }

  rt::DepthModelParameters camera_;
  rt::Vec3 hip_m_;
  std::unique_ptr<rt::DepthFrame> frame_;
  rt::DepthModel model_;
  rt::GridParameters grid_;
  rt::SceneBuilder builder_;
  rt::SceneStorage storage_;
  rt::Scene scene_;
};

double median(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + std::ssize(values) / 2);
  return values[values.size() / 2];
}

/// Times things alternately, so that other load falls on all of them alike; returns the medians.
template <std::size_t N>
std::array<double, N> medians(int repetitions, const std::array<std::function<double()>, N>& timed) {
  std::array<std::vector<double>, N> samples;
  for (int i = 0; i < repetitions; ++i) {
    for (std::size_t j = 0; j < N; ++j) samples[j].push_back(timed[j]());
  }
  std::array<double, N> result{};
  for (std::size_t j = 0; j < N; ++j) result[j] = median(std::move(samples[j]));
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
  return median(std::move(samples));
}

CameraCost costOf(const NamedCamera& named, double distance_m, int repetitions) {
  const rt::DepthModelParameters& camera = named.camera;
  const rt::DepthModelParameters kinect = kinectWithNoise();
  CameraCost cost{.camera = named.name, .distance_m = distance_m};
  cost.kinect_distance_m =
      std::clamp(distance_m * kinect.fx_px / camera.fx_px, kinect.near_m + 0.02, kinect.far_m - 0.2);
  Modelled reach(camera, distance_m, rt::ModelExtent::reach);
  Modelled surface(camera, distance_m, rt::ModelExtent::reach);
  Modelled other_reach(kinect, cost.kinect_distance_m, rt::ModelExtent::reach);
  Modelled other_surface(kinect, cost.kinect_distance_m, rt::ModelExtent::reach);
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
  const bool fits = camera.law == rt::DepthLawKind::reciprocal ||
                    (camera.far_m - camera.near_m) / camera.unit_m < rt::PackedPixel::kRawRange;
  if (fits) {
    Modelled whole(camera, distance_m, rt::ModelExtent::frame);
    cost.frame_ns =
        medians<1>(std::min(repetitions, 20), {[&] { return whole.time_ns(ForceLaw::nearest_springs); }})[0];
  }
  cost.tree_ns = treeTime_ns(camera, reach);
  return cost;
}

}  // namespace

std::vector<CameraCost> measureCameraCosts(int repetitions, const std::vector<double>& distances_m) {
  std::vector<CameraCost> costs;
  for (const NamedCamera& camera : cameras()) {
    for (const double distance_m : distances_m) {
      if (distance_m > camera.camera.near_m + 0.05) costs.push_back(costOf(camera, distance_m, repetitions));
    }
  }
  return costs;
}

std::vector<Requirement> requirementsOf(const std::vector<CameraCost>& costs) {
  constexpr double kFrom_m = 0.7;
  constexpr double kTimesCheaper = 300;
  constexpr double kPerPixel = 1.3;
  const auto all = [](const CameraCost&) { return true; };
  const auto name = [](const CameraCost& row) {
    return fmt::format("{} at {} m", row.camera, row.distance_m);
  };
  const RowRequirement<CameraCost> tree{
      "time of the reach over that of nanoflann's tree from 0.7 m on", [](const CameraCost& row) {
        return figureIf(row.distance_m >= kFrom_m, row.reach_ns / row.tree_ns, 1 / kTimesCheaper);
      }};
  const RowRequirement<CameraCost> reach{"reach: time per pixel over a Kinect's", [](const CameraCost& row) {
                                           return figureIf(true, row.reachPerPixel(), kPerPixel);
                                         }};
  const RowRequirement<CameraCost> surface{
      "surface: time per pixel over a Kinect's",
      [](const CameraCost& row) { return figureIf(true, row.surfacePerPixel(), kPerPixel); }};
  return {checked("", tree, costs, all, name), checked("", reach, costs, all, name),
          checked("", surface, costs, all, name)};
}

}  // namespace hapticd::tools
