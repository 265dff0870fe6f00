// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/field/label_field.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "tools/lib/solids/field/distance_transform.h"
#include "tools/lib/solids/files/mesh_repair.h"
#include "tools/lib/solids/files/source_file.h"

namespace hapticd::solids {
namespace {

using rt::Vec3;

constexpr std::size_t kMaxPlaces = 200'000;

Vec3 vec3Of(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}
Eigen::Vector3d eigenOf(const Vec3& v) {
  return {v.x, v.y, v.z};
}

/// The voxels resampled to a grid with one spacing along its axes, which are nearly those of the image. Made
/// orthogonal, because distances are computed along them.
struct WorkGrid {
  Eigen::Matrix3d axes;     ///< columns: unit vectors of the grid's axes in LPS
  Eigen::Matrix3d steps_m;  ///< columns: the steps of the label map
  SampledField field;       ///< in coordinates along `axes`
  std::vector<std::uint8_t> inside;

  std::array<double, 3> voxel_m{};  ///< along each of the axes, at least the spacing of the field

  Vec3 alongAxes(const Vec3& lps_m) const { return vec3Of(axes.transpose() * eigenOf(lps_m)); }
  Vec3 inLps_m(const Vec3& along_axes_m) const { return vec3Of(axes * eigenOf(along_axes_m)); }
};

/// Axes nearest to the directions of the image: exactly those if they are orthogonal. If they are along those
/// of LPS, the axes of LPS themselves, so that nothing has to be interpolated later.
Eigen::Matrix3d orthogonalAxes(const Eigen::Matrix3d& steps_m) {
  Eigen::Matrix3d unit = steps_m;
  for (int axis = 0; axis < 3; ++axis) unit.col(axis).normalize();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(unit, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d axes = svd.matrixU() * svd.matrixV().transpose();
  constexpr double kAligned = 1 - 1e-9;
  const bool is_aligned = (axes.cwiseAbs().colwise().maxCoeff().array() > kAligned).all();
  return is_aligned ? Eigen::Matrix3d::Identity() : axes;
}

/// Fills `inside` with the voxel in which each sample lies.
void resample(const LabelMap& map, WorkGrid& grid) {
  const Eigen::Matrix3d to_voxels = grid.steps_m.inverse();
  const SampledField& field = grid.field;
  grid.inside.assign(field.count(), 0);
  const Eigen::Vector3d along_row = to_voxels * grid.axes.col(0) * field.spacing_m;
  for (int z = 0; z < field.samples[2]; ++z)
    for (int y = 0; y < field.samples[1]; ++y) {
      const Eigen::Vector3d first =
          to_voxels * (grid.axes * eigenOf(field.placeOf(0, y, z)) - eigenOf(map.origin_m));
      for (int x = 0; x < field.samples[0]; ++x) {
        const Eigen::Vector3d at = first + x * along_row;
        std::size_t index = 0;
        bool is_within = true;
        for (int axis = 2; axis >= 0; --axis) {
          const int size = map.size[static_cast<std::size_t>(axis)];
          // half a voxel exactly: not decided by rounding
          const double voxel = std::floor(at[axis] + 0.5 + 1e-9);
          is_within = is_within && voxel >= 0 && voxel < size;
          if (is_within) index = index * static_cast<std::size_t>(size) + static_cast<std::size_t>(voxel);
        }
        if (is_within) grid.inside[field.indexOf(x, y, z)] = map.inside[index];
      }
    }
}

/// The box, along the axes of the grid, that contains one of LPS and a margin.
Bounds boxAlong(const WorkGrid& grid, const Bounds& box, double margin_m) {
  std::vector<Vec3> corners;
  const Vec3 margin = margin_m * Vec3{1, 1, 1}, low = box.low_m - margin, high = box.high_m + margin;
  for (unsigned corner = 0; corner < 8; ++corner)
    corners.push_back(
        grid.alongAxes({(corner & 1U) != 0 ? high.x : low.x, (corner & 2U) != 0 ? high.y : low.y,
                        (corner & 4U) != 0 ? high.z : low.z}));
  return boundsOf(corners);
}

/// The box in LPS of the voxels that are inside, with their corners.
Bounds boxOfBody(const LabelMap& map) {
  std::array<std::array<int, 2>, 3> ends{{{map.size[0], -1}, {map.size[1], -1}, {map.size[2], -1}}};
  std::size_t index = 0;
  std::array<int, 3> at{};
  for (at[2] = 0; at[2] < map.size[2]; ++at[2])
    for (at[1] = 0; at[1] < map.size[1]; ++at[1])
      for (at[0] = 0; at[0] < map.size[0]; ++at[0])
        if (map.inside[index++] != 0)
          for (std::size_t axis = 0; axis < 3; ++axis)
            ends[axis] = {std::min(ends[axis][0], at[axis]), std::max(ends[axis][1], at[axis])};
  std::vector<Vec3> corners;
  for (unsigned corner = 0; corner < 8; ++corner) {
    const auto end = [&](std::size_t axis) {
      return (corner >> axis & 1U) != 0 ? ends[axis][1] + 0.5 : ends[axis][0] - 0.5;
    };
    corners.push_back(map.centreOf(end(0), end(1), end(2)));
  }
  return boundsOf(corners);
}

/// Visits the neighbours of samples along the axes: calls visit(index, neighbour's index, place, axis).
template <typename Visit>
void forEachNeighbour(const SampledField& field, Visit visit) {
  for (int z = 0; z < field.samples[2]; ++z)
    for (int y = 0; y < field.samples[1]; ++y)
      for (int x = 0; x < field.samples[0]; ++x) {
        const std::size_t index = field.indexOf(x, y, z);
        if (x + 1 < field.samples[0]) visit(index, field.indexOf(x + 1, y, z), std::array{x, y, z}, 0);
        if (y + 1 < field.samples[1]) visit(index, field.indexOf(x, y + 1, z), std::array{x, y, z}, 1);
        if (z + 1 < field.samples[2]) visit(index, field.indexOf(x, y, z + 1), std::array{x, y, z}, 2);
      }
}

Vec3 alongAxis(int axis, double length) {
  return {axis == 0 ? length : 0, axis == 1 ? length : 0, axis == 2 ? length : 0};
}

std::vector<Vec3> thinned(std::vector<Vec3> places) {
  const std::size_t step = (places.size() + kMaxPlaces - 1) / kMaxPlaces;
  if (step <= 1) return places;
  std::vector<Vec3> chosen;
  for (std::size_t i = 0; i < places.size(); i += step) chosen.push_back(places[i]);
  return chosen;
}

/// Places next to the surface of the smoothed body, and the distance there.
struct References {
  std::vector<Vec3> places_m;
  std::vector<double> distances_m;
};

/// The centre of each cell through which the surface passes; the distance there by cubic interpolation, whose
/// error is of fourth order.
References referencesIn(const SampledField& field) {
  constexpr std::array<double, 4> kWeights{-1.0 / 16, 9.0 / 16, 9.0 / 16, -1.0 / 16};
  References all;
  for (int z = 1; z + 2 < field.samples[2]; ++z)
    for (int y = 1; y + 2 < field.samples[1]; ++y)
      for (int x = 1; x + 2 < field.samples[0]; ++x) {
        bool has_inside = false, has_outside = false;
        for (int corner = 0; corner < 8; ++corner) {
          const float value =
              field.distance_m[field.indexOf(x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2))];
          (value < 0 ? has_inside : has_outside) = true;
        }
        if (!has_inside || !has_outside) continue;
        double distance_m = 0;
        for (int tap = 0; tap < 64; ++tap) {
          const int i = tap & 3, j = tap >> 2 & 3, k = tap >> 4;
          const double weight = kWeights[static_cast<std::size_t>(i)] *
                                kWeights[static_cast<std::size_t>(j)] * kWeights[static_cast<std::size_t>(k)];
          distance_m +=
              weight * static_cast<double>(field.distance_m[field.indexOf(x + i - 1, y + j - 1, z + k - 1)]);
        }
        all.places_m.push_back(field.placeOf(x, y, z) + 0.5 * field.spacing_m * Vec3{1, 1, 1});
        all.distances_m.push_back(distance_m);
      }
  const std::size_t step = std::max<std::size_t>(1, all.places_m.size() / kMaxPlaces);
  References chosen;
  for (std::size_t i = 0; i < all.places_m.size(); i += step) {
    chosen.places_m.push_back(all.places_m[i]);
    chosen.distances_m.push_back(all.distances_m[i]);
  }
  return chosen;
}

/// Centres of the faces between samples inside and outside.
std::vector<Vec3> facesOf(const WorkGrid& grid) {
  std::vector<Vec3> places;
  forEachNeighbour(
      grid.field, [&](std::size_t index, std::size_t next, const std::array<int, 3>& at, int axis) {
        if (grid.inside[index] == grid.inside[next]) return;
        places.push_back(grid.field.placeOf(at[0], at[1], at[2]) + alongAxis(axis, grid.field.spacing_m / 2));
      });
  return thinned(std::move(places));
}

/// By how much smoothing moves the surface at all but one in a hundred places: half of each variance times
/// the second derivative of the distance along its axis.
double largestBias(const WorkGrid& grid) {
  const SampledField& field = grid.field;
  const auto half_variance = [&](std::size_t axis) {
    return 0.5 * std::pow(grid.voxel_m[axis] / field.spacing_m, 2);
  };
  const double a = half_variance(0), b = half_variance(1), c = half_variance(2);
  std::vector<double> biases;
  for (int z = 1; z + 1 < field.samples[2]; ++z)
    for (int y = 1; y + 1 < field.samples[1]; ++y)
      for (int x = 1; x + 1 < field.samples[0]; ++x) {
        const auto value = [&](int dx, int dy, int dz) {
          return static_cast<double>(field.distance_m[field.indexOf(x + dx, y + dy, z + dz)]);
        };
        const double centre = value(0, 0, 0);
        if (std::abs(centre) > field.spacing_m / 2) continue;
        biases.push_back(std::abs(a * (value(1, 0, 0) + value(-1, 0, 0) - 2 * centre) +
                                  b * (value(0, 1, 0) + value(0, -1, 0) - 2 * centre) +
                                  c * (value(0, 0, 1) + value(0, 0, -1) - 2 * centre)));
      }
  if (biases.empty()) return 0;
  const auto high = biases.begin() + static_cast<std::ptrdiff_t>(biases.size() * 99 / 100);
  std::ranges::nth_element(biases, high);
  return *high;
}

/// "1.0 mm", or "0.7 x 0.7 x 5.0 mm" of what is not the same along all axes.
std::string textOf(const std::array<double, 3>& lengths_m) {
  const auto [x, y, z] = lengths_m;
  return x == y && y == z ? fmt::format("{:.1f} mm", 1e3 * x)
                          : fmt::format("{:.1f} x {:.1f} x {:.1f} mm", 1e3 * x, 1e3 * y, 1e3 * z);
}

std::string thinText(const LabelField& result) {
  const auto [x, y, z] = result.smoothing_m;
  return fmt::format("thinner than about two voxels ({})", textOf({2 * x, 2 * y, 2 * z}));
}

/// Voxels from which the smoothed body is farther away, in voxels, than smoothing rounds off a corner.
void findLostParts(const WorkGrid& grid, LabelField& result) {
  std::vector<std::uint8_t> is_kept(grid.inside.size());
  for (std::size_t i = 0; i < is_kept.size(); ++i) is_kept[i] = grid.field.distance_m[i] < 0 ? 1 : 0;
  const GridSize size = grid.field.samples;
  const double h = grid.field.spacing_m;
  const std::array<double, 3>& voxel_m = grid.voxel_m;
  const std::vector<float> to_kept =
      squaredDistances(is_kept, size, {h / voxel_m[0], h / voxel_m[1], h / voxel_m[2]});
  constexpr double kRounded = 1.5;
  std::size_t inside = 0, lost = 0;
  float farthest = 0;
  for (int z = 0; z < size[2]; ++z)
    for (int y = 0; y < size[1]; ++y)
      for (int x = 0; x < size[0]; ++x) {
        const std::size_t index = grid.field.indexOf(x, y, z);
        if (grid.inside[index] == 0) continue;
        ++inside;
        if (std::sqrt(static_cast<double>(to_kept[index])) <= kRounded) continue;
        ++lost;
        if (to_kept[index] <= farthest && result.lost) continue;
        farthest = to_kept[index];
        result.lost = ThinPlace{2 * std::ranges::max(voxel_m), grid.inLps_m(grid.field.placeOf(x, y, z))};
      }
  result.lost_share = inside > 0 ? static_cast<double>(lost) / static_cast<double>(inside) : 0;
  if (lost > 0)
    result.report.warnings.push_back(
        fmt::format("{:.2g} % of the segment is {} and is lost, e.g. at {}: "
                    "thicken it (Segment "
                    "Editor, Margin, Grow) or segment with smaller voxels",
                    100 * result.lost_share, thinText(result), millimetreText(result.lost->place_m)));
}

/// The label map as a smoothed distance on a grid along the axes of the image.
base::Result<WorkGrid> smoothedDistance(const LabelMap& map, const std::string& name,
                                        const FieldOptions& options, LabelField& result) {
  WorkGrid grid;
  for (int axis = 0; axis < 3; ++axis)
    grid.steps_m.col(axis) = eigenOf(map.steps_m[static_cast<std::size_t>(axis)]);
  grid.axes = orthogonalAxes(grid.steps_m);
  const double smallest_m = grid.steps_m.colwise().norm().minCoeff(),
               largest_m = grid.steps_m.colwise().norm().maxCoeff();
  const Bounds body = boxOfBody(map);
  const double finest_m = finestSpacing(body.low_m, body.high_m, options);
  const double spacing_m = std::max(smallest_m, finest_m);
  if (!(spacing_m <= 2 * largest_m))
    return refused(name,
                   fmt::format("the limits allow a spacing of {:.2f} mm, more than two voxels of {:.2f} mm",
                               spacing_m * 1e3, largest_m * 1e3),
                   "crop the segment to where the tool works");
  const Bounds box = boxAlong(grid, body, bandOf(options, spacing_m) + 2 * spacing_m);
  grid.field = gridAbout(box.low_m, box.high_m, 0, spacing_m);
  // samples at the centres of voxels, so that cubic voxels are copied instead of interpolated
  const Vec3 first = grid.alongAxes(map.origin_m);
  const auto snapped = [&](double origin, double centre) {
    return centre + std::round((origin - centre) / spacing_m) * spacing_m;
  };
  grid.field.origin_m = {snapped(grid.field.origin_m.x, first.x), snapped(grid.field.origin_m.y, first.y),
                         snapped(grid.field.origin_m.z, first.z)};
  resample(map, grid);
  if (std::ranges::find(grid.inside, 1) == grid.inside.end())
    return refused(name, "no voxel is inside", "choose another segment");
  for (int axis = 0; axis < 3; ++axis) {
    const double step_m = std::max(norm(map.steps_m[static_cast<std::size_t>(axis)]), spacing_m);
    result.smoothing_m[static_cast<std::size_t>(axis)] = step_m;
    Eigen::Index along = 0;  // the axis of the grid which that of the image is nearest to
    (grid.axes.transpose() * grid.steps_m.col(axis)).cwiseAbs().maxCoeff(&along);
    grid.voxel_m[static_cast<std::size_t>(along)] = step_m;
  }
  grid.field.distance_m = signedDistances(grid.inside, grid.field.samples, spacing_m);
  const std::array<double, 3>& voxel_m = grid.voxel_m;
  smoothGaussian(grid.field.distance_m, grid.field.samples,
                 {voxel_m[0] / spacing_m, voxel_m[1] / spacing_m, voxel_m[2] / spacing_m});
  findLostParts(grid, result);
  if (std::ranges::none_of(grid.field.distance_m, [](float distance) { return distance < 0; }))
    return refused(name, "the whole segment is " + thinText(result),
                   "thicken it (Segment Editor, Margin, Grow) or segment with smaller voxels");
  double variances_m2 = 0, least_m2 = std::numeric_limits<double>::infinity();
  for (const double sigma_m : voxel_m) {
    variances_m2 += sigma_m * sigma_m;
    least_m2 = std::min(least_m2, sigma_m * sigma_m);
  }
  result.bias_bound_m = std::max(0.5 * (variances_m2 - least_m2) * kBiasCurvature_per_m, largestBias(grid));
  result.from_voxels = surfaceError(grid.field, facesOf(grid), {}, trilinearReader);
  result.from_voxels.worst_m = grid.inLps_m(result.from_voxels.worst_m);
  return grid;
}

/// Samples the work grid, which reaches beyond it, along the axes of LPS.
SampledField sampleInLps(const WorkGrid& grid, const Bounds& box, double band_m, double spacing_m) {
  SampledField field = gridAbout(box.low_m, box.high_m, band_m, spacing_m);
  const Vec3 from_work = (1 / spacing_m) * (field.origin_m - grid.field.origin_m);
  const bool is_same = grid.axes.isIdentity(0) && spacing_m == grid.field.spacing_m;
  // samples at those of the work grid where there is nothing to turn or to scale
  if (is_same)
    field.origin_m = grid.field.origin_m + spacing_m * Vec3{std::floor(from_work.x), std::floor(from_work.y),
                                                            std::floor(from_work.z)};
  for (int z = 0; z < field.samples[2]; ++z)
    for (int y = 0; y < field.samples[1]; ++y)
      for (int x = 0; x < field.samples[0]; ++x)
        field.distance_m[field.indexOf(x, y, z)] =
            static_cast<float>(trilinearValue(grid.field, grid.alongAxes(field.placeOf(x, y, z))));
  return field;
}

}  // namespace

base::Result<LabelField> fieldOfLabel(const LabelMap& map, const std::string& name,
                                      const FieldOptions& options) {
  if (auto done = checkOptions(options, name); !done) return std::unexpected(done.error());
  std::size_t voxels = 1;
  for (const int size : map.size) voxels *= static_cast<std::size_t>(std::max(size, 0));
  if (voxels != map.inside.size() || std::ranges::find(map.inside, 1) == map.inside.end())
    return refused(name, "no voxel is inside", "choose another segment");
  LabelField result;
  const auto grid = smoothedDistance(map, name, options, result);
  if (!grid) return std::unexpected(grid.error());
  References references = referencesIn(grid->field);
  for (Vec3& place : references.places_m) place = grid->inLps_m(place);
  const Bounds box = boxOfBody(map);
  result.report.finest_spacing_m = finestSpacing(box.low_m, box.high_m, options);
  SpacingSearch search(std::max(grid->field.spacing_m, result.report.finest_spacing_m),
                       result.report.finest_spacing_m, options.tolerance_m);
  constexpr int kMaxRounds = 30;  // the spacing falls by at least a tenth each time
  for (int round = 0; round < kMaxRounds; ++round) {
    result.report.band_m = bandOf(options, search.spacing_m());
    result.field = sampleInLps(*grid, box, result.report.band_m, search.spacing_m());
    result.report.surface =
        surfaceError(result.field, references.places_m, references.distances_m, options.reader);
    const auto is_done = search.take(result.report.surface, name);
    if (!is_done) return std::unexpected(is_done.error());
    if (*is_done) return result;
  }
  return refused(name, "no spacing was found", "choose a larger tolerance");
}

}  // namespace hapticd::solids
