// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "config/conflicts.h"
#include "config/depth_cameras.h"
#include "config/law_choice.h"
#include "config/parameter_table.h"
#include "config/value_text.h"
#include "rt/depth_model.h"
#include "rt/law_table.h"
#include "rt/scene.h"
#include "rt/scene_builder.h"

namespace hapticd::config {
namespace {

// Largest number of occupancy words (64 voxels each) of a scene over the whole frame: 25 MB for each of the
// three scenes.
constexpr std::size_t kMaxWords = std::size_t{1} << 21;

// Keeps a rounded number on the safe side of the exact one despite rounding errors.
constexpr double kSafeSide = 1e-9;

// Rounds `number` to three significant digits, up or down.
double rounded(double number, bool up) {
  if (!(number > 0)) return number;
  const double step = std::pow(10.0, std::floor(std::log10(number)) - 2);
  return step * (up ? std::ceil(number / step + kSafeSide) : std::floor(number / step - kSafeSide));
}

// A law that may be used, and the radius around the HIP that it needs to be modelled.
struct Demand {
  rt::LiveParameters live;
  rt::SceneNeeds needs;
  double reach_m = 0;

  Demand(const rt::LiveParameters& parameters, const rt::GridParameters& grid)
      : live(parameters), needs(rt::SceneNeeds::of(parameters)), reach_m(rt::reachOfModel_m(needs, grid)) {}
};

std::vector<Demand> demandsOf(const Settings& settings) {
  std::vector<Demand> demands;
  for (const rt::LiveParameters& live : lawsThatMayAct(settings)) demands.emplace_back(live, settings.grid);
  return demands;
}

// Returns whether the window of points covers this reach, with one voxel on each side, because the window
// follows the HIP in whole voxels.
bool windowHolds(double reach_m, const rt::GridParameters& grid) {
  return 2 * reach_m + 2 * grid.voxel_edge_m <= grid.cells_per_axis * grid.voxel_edge_m;
}

double largestReachOfWindow_m(const rt::GridParameters& grid) {
  return (grid.cells_per_axis - 2) * grid.voxel_edge_m / 2;
}

bool isMet(const Demand& demand, const rt::GridParameters& grid) {
  if (demand.needs.visible_surface) return true;
  return grid.extent == rt::ModelExtent::frame || windowHolds(demand.reach_m, grid);
}

bool allMet(const Settings& settings) {
  return std::ranges::all_of(demandsOf(settings),
                             [&](const Demand& demand) { return isMet(demand, settings.grid); });
}

// Returns the largest demand that is not met.
std::optional<Demand> largestUnmet(const Settings& settings) {
  std::optional<Demand> largest;
  for (const Demand& demand : demandsOf(settings)) {
    if (isMet(demand, settings.grid)) continue;
    if (!largest || demand.reach_m > largest->reach_m) largest = demand;
  }
  return largest;
}

// Collects texts such as "grid.voxel_edge_m to at least 0.02" for allowed values that resolve the conflict.
class Remedies {
 public:
  explicit Remedies(const Settings& settings) : settings_(settings) {}

  void suggest(std::string_view name, std::string_view bound, double value) {
    const Parameter& parameter = *findParameter(name);
    const std::string text = fmt::format("{:.4g}", value);
    const Result<Value> allowed = parameter.parse(text);
    if (!allowed) return;
    Settings changed = settings_;
    parameter.set(changed, *allowed);
    if (allMet(changed)) texts_.push_back(fmt::format("{} to at {} {}", name, bound, text));
  }

  std::string text(std::string_view otherwise) const {
    return texts_.empty() ? std::string(otherwise) : fmt::format("set {}", fmt::join(texts_, ", or "));
  }

 private:
  const Settings& settings_;
  std::vector<std::string> texts_;
};

double interval_s(const rt::GridParameters& grid) {
  return grid.frame_period_s + grid.frame_margin_s;
}

std::string windowRemedy(const Settings& settings, const Demand& demand) {
  const rt::GridParameters& grid = settings.grid;
  const double largest_m = largestReachOfWindow_m(grid);
  const double excess_m = demand.reach_m - largest_m;
  const double inner_cells = grid.cells_per_axis - 2;
  Remedies remedies(settings);
  remedies.suggest("grid.cells_per_axis", "least",
                   std::ceil(2 * demand.reach_m / grid.voxel_edge_m + 2 + kSafeSide));
  remedies.suggest("grid.voxel_edge_m", "least", rounded(2 * demand.reach_m / inner_cells, true));
  remedies.suggest("grid.max_hip_speed_m_per_s", "most",
                   rounded((largest_m - demand.needs.radius_m) / interval_s(grid), false));
  if (rt::rowOf(demand.live.law).looks_in_radius) {
    remedies.suggest("force.radius_m", "most", rounded(settings.live.springs.radius_m - excess_m, false));
  }
  return remedies.text(
      "raise grid.voxel_edge_m and grid.cells_per_axis together, or lower grid.max_hip_speed_m_per_s and the "
      "law's radius together; one alone is not enough");
}

// Returns e.g. "nearest_springs", with a note if auto may choose it.
std::string lawText(const Settings& settings, const Demand& demand) {
  return fmt::format("{}{}", nameOf(demand.live.law), settings.force.law ? "" : ", which auto may choose,");
}

// Returns e.g. "0.096 m on each side: 0.064 m that it looks at + grid.max_hip_speed_m_per_s ...".
std::string reachText(const Settings& settings, const Demand& demand) {
  const rt::GridParameters& grid = settings.grid;
  return fmt::format(
      "{:.4g} m on each side: {:.4g} m that it looks at + grid.max_hip_speed_m_per_s {} m/s * "
      "{:.4g} s of frame period and margin",
      demand.reach_m, demand.needs.radius_m, numberText(grid.max_hip_speed_m_per_s), interval_s(grid));
}

// Returns `first` and all parameters that determine which laws may be used and how far they reach.
std::vector<std::string_view> joinedWithReach(std::vector<std::string_view> first) {
  for (const std::string_view name : {"grid.max_hip_speed_m_per_s", "force.law", "force.radius_m",
                                      "contact.proxy_radius_m", "grid.frame_period_s", "grid.frame_margin_s",
                                      "force.max_error_n", "force.stiffness_n_per_m", "safety.max_force_n"}) {
    if (std::ranges::find(first, name) == first.end()) first.push_back(name);
  }
  return first;
}

std::size_t wordsOfFrameGrid(rt::GridParameters grid, const rt::DepthModel& model, double edge_m) {
  grid.frame_voxel_edge_m = edge_m;
  return rt::GridShape::of(grid, model).words();
}

// Returns the smallest allowed edge, in steps of a millimetre, with a grid that is small enough.
std::optional<double> coarserEdge(const rt::GridParameters& grid, const rt::DepthModel& model) {
  const double largest_m = findParameter("grid.frame_voxel_edge_m")->maximum;
  for (int millimetres = 1; millimetres * 1e-3 <= largest_m; ++millimetres) {
    const double edge_m = millimetres * 1e-3;
    if (edge_m > grid.frame_voxel_edge_m && wordsOfFrameGrid(grid, model, edge_m) <= kMaxWords) return edge_m;
  }
  return std::nullopt;
}

// Returns whether the depth unit is known only when the camera has been opened.
bool unitIsOpen(const CameraSettings& camera) {
  return camera.driver == CameraDriver::v4l2 && camera.v4l2.unit_um == 0;
}

// A scene of the whole frame holds as many depth units as a packed pixel.
void findWholeFrameConflict(const Settings& settings, std::vector<Conflict>& conflicts) {
  if (unitIsOpen(settings.camera)) return;
  const rt::DepthModelParameters depth = settings.camera.effectiveDepthModel();
  const double unit_m = depth.unit_m;
  constexpr double kUnits = rt::PackedPixel::kRawRange - 1;
  const double range_m = depth.far_m - depth.near_m;
  if (!(range_m > 0) || range_m < kUnits * unit_m) return;
  conflicts.push_back(
      {.parameters = {"camera.unit_um", "grid.extent", "camera.near_m", "camera.far_m", "camera.driver",
                      "synthetic.camera"},
       .error = {"camera.unit_um",
                 fmt::format("a scene of the whole frame holds {:.4g} m of depth in units of {:.4g} um, but "
                             "from camera.near_m to camera.far_m it is {} m",
                             kUnits * unit_m, unit_m * 1e6, numberText(range_m)),
                 fmt::format("set camera.unit_um to at least {:.0f}, or grid.extent to reach",
                             std::ceil(1e6 * range_m / kUnits + kSafeSide))}});
}

}  // namespace

void findWindowConflict(const Settings& settings, std::vector<Conflict>& conflicts) {
  const auto demand = largestUnmet(settings);
  if (!demand) return;
  const rt::GridParameters& grid = settings.grid;
  std::string what = fmt::format(
      "{} voxels of {} m make a window of {:.4g} m, but the law {} needs {:.4g} m: {}, and one voxel",
      grid.cells_per_axis, numberText(grid.voxel_edge_m), grid.cells_per_axis * grid.voxel_edge_m,
      lawText(settings, *demand), 2 * demand->reach_m + 2 * grid.voxel_edge_m, reachText(settings, *demand));
  conflicts.push_back(
      {.parameters = joinedWithReach({"grid.cells_per_axis", "grid.voxel_edge_m", "grid.extent"}),
       .error = {"grid.cells_per_axis", std::move(what), windowRemedy(settings, *demand)}});
}

void findDepthUnitConflict(const Settings& settings, std::vector<Conflict>& conflicts) {
  const CameraSettings& camera = settings.camera;
  if (!camera.deliversDepth()) return;
  if (settings.grid.extent == rt::ModelExtent::frame) return findWholeFrameConflict(settings, conflicts);
  const double unit_m = unitIsOpen(camera) ? kFineUnit_m : camera.effectiveDepthModel().unit_m;
  std::optional<Demand> largest;
  for (const Demand& demand : demandsOf(settings)) {
    const bool fits = !demand.needs.points || demand.reach_m <= rt::largestReachOfUnit_m(unit_m);
    if (!fits && (!largest || demand.reach_m > largest->reach_m)) largest = demand;
  }
  if (!largest) return;
  const double least_um = std::ceil(1e6 * largest->reach_m / rt::largestReachOfUnit_m(1));
  conflicts.push_back(
      {.parameters = joinedWithReach({"camera.unit_um", "camera.driver", "synthetic.camera", "grid.extent"}),
       .error = {
           "camera.unit_um",
           fmt::format("a scene holds {:.4g} m of depth in units of {:.4g} um, but the law {} needs {:.4g} "
                       "m: {}",
                       2 * rt::largestReachOfUnit_m(unit_m), unit_m * 1e6, lawText(settings, *largest),
                       2 * largest->reach_m, reachText(settings, *largest)),
           fmt::format("set camera.unit_um to at least {:.0f}, or lower force.radius_m or "
                       "grid.max_hip_speed_m_per_s",
                       least_um)}});
}

void findFrameGridConflict(const Settings& settings, std::vector<Conflict>& conflicts) {
  const rt::DepthModelParameters depth = settings.camera.effectiveDepthModel();
  if (settings.grid.extent != rt::ModelExtent::frame || !(depth.near_m < depth.far_m)) return;
  const rt::DepthModel model(depth, settings.camera.pose);
  const double edge_m = settings.grid.frame_voxel_edge_m;
  if (wordsOfFrameGrid(settings.grid, model, edge_m) <= kMaxWords) return;
  const std::optional<double> coarser = coarserEdge(settings.grid, model);
  const std::string lower_far = fmt::format("camera.far_m below {} m", numberText(depth.far_m));
  conflicts.push_back(
      {.parameters = {"grid.frame_voxel_edge_m", "grid.extent", "camera.far_m", "camera.fx_px",
                      "camera.fy_px"},
       .error = {
           "grid.frame_voxel_edge_m",
           fmt::format("voxels of {} m over the camera's whole view up to camera.far_m, {} m, take more "
                       "memory than is reserved",
                       numberText(edge_m), numberText(depth.far_m)),
           coarser ? fmt::format("set grid.frame_voxel_edge_m to at least {:.4g}, or {}", *coarser, lower_far)
                   : fmt::format("set {}", lower_far)}});
}

}  // namespace hapticd::config
