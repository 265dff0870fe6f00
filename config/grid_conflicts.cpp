#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <optional>
#include <string>

#include "config/conflicts.h"
#include "config/parameter_table.h"
#include "config/value_text.h"
#include "rt/depth_model.h"
#include "rt/scene.h"

namespace hapticd::config {
namespace {

// Occupancy words of 64 voxels that a scene over the whole frame may have: 25 MB for each of the three
// scenes.
constexpr std::size_t kMostWords = std::size_t{1} << 21;

// Keeps a rounded number on the safe side of an exact one whatever the last bits of the arithmetic are.
constexpr double kSafeSide = 1e-9;

// `number` to three significant digits, above it (up) or below it (down).
double rounded(double number, bool up) {
  if (!(number > 0)) return number;
  const double step = std::pow(10.0, std::floor(std::log10(number)) - 2);
  return step * (up ? std::ceil(number / step + kSafeSide) : std::floor(number / step - kSafeSide));
}

double reachOf(const Settings& settings) {
  const rt::GridParameters& grid = settings.grid;
  return settings.live.springs.radius_m +
         grid.max_hip_speed_m_per_s * (grid.frame_period_s + grid.frame_margin_s);
}

bool windowHoldsReach(const Settings& settings) {
  const rt::GridParameters& grid = settings.grid;
  // One voxel on each side: the window follows the HIP in whole voxels.
  return 2 * reachOf(settings) + 2 * grid.voxel_edge_m <= grid.cells_per_axis * grid.voxel_edge_m;
}

// Adds "grid.voxel_edge_m to at least 0.02" if that value is allowed and mends the conflict.
void suggest(std::vector<std::string>& remedies, std::string_view name, std::string_view bound, double value,
             const Settings& settings) {
  const Parameter& parameter = *findParameter(name);
  const std::string text = fmt::format("{:.4g}", value);
  const Result<Value> allowed = parameter.parse(text);
  if (!allowed) return;
  Settings mended = settings;
  parameter.set(mended, *allowed);
  if (!windowHoldsReach(mended)) return;
  remedies.push_back(fmt::format("{} to at {} {}", name, bound, text));
}

std::string windowRemedy(const Settings& settings) {
  const rt::GridParameters& grid = settings.grid;
  const double reach_m = reachOf(settings);
  const double inner_cells = grid.cells_per_axis - 2;
  const double largest_reach_m = inner_cells * grid.voxel_edge_m / 2;
  const double interval_s = grid.frame_period_s + grid.frame_margin_s;
  const double radius_m = settings.live.springs.radius_m;
  std::vector<std::string> remedies;
  suggest(remedies, "grid.cells_per_axis", "least",
          std::ceil(2 * reach_m / grid.voxel_edge_m + 2 + kSafeSide), settings);
  suggest(remedies, "grid.voxel_edge_m", "least", rounded(2 * reach_m / inner_cells, true), settings);
  suggest(remedies, "grid.max_hip_speed_m_per_s", "most",
          rounded((largest_reach_m - radius_m) / interval_s, false), settings);
  suggest(remedies, "force.radius_m", "most",
          rounded(largest_reach_m - grid.max_hip_speed_m_per_s * interval_s, false), settings);
  if (remedies.empty()) {
    return "raise grid.voxel_edge_m and grid.cells_per_axis together, or lower grid.max_hip_speed_m_per_s "
           "and "
           "force.radius_m together; one alone is not enough";
  }
  return fmt::format("set {}", fmt::join(remedies, ", or "));
}

std::size_t wordsOfFrameGrid(rt::GridParameters grid, const rt::DepthModel& model, double edge_m) {
  grid.frame_voxel_edge_m = edge_m;
  return rt::GridShape::of(grid, model).words();
}

// The smallest allowed edge, in steps of a millimetre, whose grid is small enough.
std::optional<double> coarserEdge(const rt::GridParameters& grid, const rt::DepthModel& model) {
  const double largest_m = findParameter("grid.frame_voxel_edge_m")->maximum;
  for (int millimetres = 1; millimetres * 1e-3 <= largest_m; ++millimetres) {
    const double edge_m = millimetres * 1e-3;
    if (edge_m > grid.frame_voxel_edge_m && wordsOfFrameGrid(grid, model, edge_m) <= kMostWords)
      return edge_m;
  }
  return std::nullopt;
}

}  // namespace

void findWindowConflict(const Settings& settings, std::vector<Conflict>& conflicts) {
  const rt::GridParameters& grid = settings.grid;
  if (grid.extent != rt::ModelExtent::reach || windowHoldsReach(settings)) return;
  const double reach_m = reachOf(settings);
  std::string what = fmt::format(
      "{} voxels of {} m make a window of {:.4g} m, but the HIP's reach needs {:.4g} m: on each side {:.4g} "
      "m "
      "(force.radius_m {} m + grid.max_hip_speed_m_per_s {} m/s * {:.4g} s of frame period and margin) and "
      "one "
      "voxel",
      grid.cells_per_axis, numberText(grid.voxel_edge_m), grid.cells_per_axis * grid.voxel_edge_m,
      2 * reach_m + 2 * grid.voxel_edge_m, reach_m, numberText(settings.live.springs.radius_m),
      numberText(grid.max_hip_speed_m_per_s), grid.frame_period_s + grid.frame_margin_s);
  conflicts.push_back(
      {.parameters = {"grid.cells_per_axis", "grid.voxel_edge_m", "grid.max_hip_speed_m_per_s",
                      "force.radius_m", "grid.frame_period_s", "grid.frame_margin_s", "grid.extent"},
       .error = {"grid.cells_per_axis", std::move(what), windowRemedy(settings)}});
}

void findFrameGridConflict(const Settings& settings, std::vector<Conflict>& conflicts) {
  const rt::DepthModelParameters depth = settings.camera.effectiveDepthModel();
  if (settings.grid.extent != rt::ModelExtent::frame || !(depth.near_m < depth.far_m)) return;
  const rt::DepthModel model(depth, settings.camera.pose);
  const double edge_m = settings.grid.frame_voxel_edge_m;
  if (wordsOfFrameGrid(settings.grid, model, edge_m) <= kMostWords) return;
  const std::optional<double> coarser = coarserEdge(settings.grid, model);
  const std::string lower_far = fmt::format("camera.far_m below {} m", numberText(depth.far_m));
  conflicts.push_back(
      {.parameters = {"grid.frame_voxel_edge_m", "grid.extent", "camera.far_m", "camera.fx_px",
                      "camera.fy_px"},
       .error = {
           "grid.frame_voxel_edge_m",
           fmt::format("voxels of {} m over all that the camera sees up to camera.far_m, {} m, take more "
                       "memory than is set aside",
                       numberText(edge_m), numberText(depth.far_m)),
           coarser ? fmt::format("set grid.frame_voxel_edge_m to at least {:.4g}, or {}", *coarser, lower_far)
                   : fmt::format("set {}", lower_far)}});
}

}  // namespace hapticd::config
