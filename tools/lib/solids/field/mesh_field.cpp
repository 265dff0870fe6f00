// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/field/mesh_field.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "tools/lib/solids/files/source_file.h"

namespace hapticd::solids {
namespace {

using rt::Vec3;

constexpr double kInside = 0.5;  // winding numbers above this are inside
/// On the surface itself the winding number is about 1/2 of any mesh, and the sign does not matter.
constexpr double kOnSurface_m = 1e-7;
constexpr double kUnclearFrom = 0.2, kUnclearTo = 0.8;

/// Samples in blocks, so that those far from the surface cost one query for all of them.
class MeshSampling {
 public:
  MeshSampling(const MeshBody& body, double band_m, SampledField& grid)
      : body_(body),
        tree_(body.surface()),
        band_m_(band_m),
        grid_(grid),
        nearest_(grid.count(), TriangleTree::kNone),
        is_far_(grid.count(), 0) {}

  WindingRange run(FarSamples far_samples) {
    for (int z = 0; z < grid_.samples[2]; z += kBlock)
      for (int y = 0; y < grid_.samples[1]; y += kBlock)
        for (int x = 0; x < grid_.samples[0]; x += kBlock) sampleBlock({x, y, z});
    const unsigned orders = far_samples == FarSamples::nearly_exact ? 8 : 0;
    for (unsigned directions = 0; directions < orders; ++directions) spread(directions);
    return winding_;
  }

 private:
  static constexpr int kBlock = 4;

  /// The nearest triangle, found quickly where the one before is near.
  NearestTriangle nearestTo(const Vec3& place_m) {
    NearestTriangle guess;
    if (last_ != TriangleTree::kNone) guess = {last_, tree_.squaredDistance(place_m, last_)};
    const NearestTriangle found = tree_.nearest(place_m, guess);
    last_ = found.triangle;
    return found;
  }

  void sampleBlock(const std::array<int, 3>& first) {
    std::array<int, 3> end{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      end[axis] = std::min(first[axis] + kBlock, grid_.samples[axis]);
    const Vec3 low_m = grid_.placeOf(first[0], first[1], first[2]);
    const Vec3 high_m = grid_.placeOf(end[0] - 1, end[1] - 1, end[2] - 1);
    const Vec3 centre_m = 0.5 * (low_m + high_m);
    const double radius_m = 0.5 * norm(high_m - low_m);
    const NearestTriangle of_centre = nearestTo(centre_m);
    const bool is_far = std::sqrt(of_centre.squared_m2) > band_m_ + radius_m;
    if (is_far) return fillFarBlock(first, end, of_centre.triangle, body_.winding(centre_m) > kInside);
    // each sample has a neighbour that was visited before: in its row, or the begin of the row or layer
    // before
    Signed layer, row, last;
    for (int z = first[2]; z < end[2]; ++z)
      for (int y = first[1]; y < end[1]; ++y)
        for (int x = first[0]; x < end[0]; ++x) {
          const Signed& before = x > first[0] ? last : y > first[1] ? row : layer;
          last = sample(x, y, z, before, centre_m, of_centre);
          if (x == first[0]) row = last;
          if (x == first[0] && y == first[1]) layer = last;
        }
  }

  /// Distance of a sample, and on which side it is; the default: of none.
  struct Signed {
    double distance_m = 0;
    bool is_inside = false;
  };

  /// `before`: a sample one spacing away. `centre`: of the block, and its nearest triangle.
  Signed sample(int x, int y, int z, const Signed& before, const Vec3& centre_m,
                const NearestTriangle& of_centre) {
    const Vec3 place_m = grid_.placeOf(x, y, z);
    const std::size_t index = grid_.indexOf(x, y, z);
    const bool is_far = std::sqrt(of_centre.squared_m2) - norm(place_m - centre_m) > band_m_;
    is_far_[index] = is_far ? 1 : 0;
    nearest_[index] = is_far ? of_centre.triangle : nearestTo(place_m).triangle;
    const double distance_m = std::sqrt(tree_.squaredDistance(place_m, nearest_[index]));
    // a surface between two samples is not farther from both than they are from each other
    const bool same_side =
        before.distance_m + distance_m > (1 + 1e-9) * grid_.spacing_m && before.distance_m > 0;
    const bool is_known =
        same_side && (body_.isClosed() || std::min(before.distance_m, distance_m) > band_m_);
    const bool is_inside =
        is_known ? before.is_inside : isInside(place_m, distance_m <= band_m_ && distance_m > kOnSurface_m);
    grid_.distance_m[index] = static_cast<float>(is_inside ? -distance_m : distance_m);
    return {distance_m, is_inside};
  }

  /// No surface passes through a block that is far away, so it lies on one side.
  void fillFarBlock(const std::array<int, 3>& first, const std::array<int, 3>& end, std::uint32_t triangle,
                    bool is_inside) {
    for (int z = first[2]; z < end[2]; ++z)
      for (int y = first[1]; y < end[1]; ++y)
        for (int x = first[0]; x < end[0]; ++x) {
          const std::size_t index = grid_.indexOf(x, y, z);
          const double distance_m = std::sqrt(tree_.squaredDistance(grid_.placeOf(x, y, z), triangle));
          is_far_[index] = 1;
          nearest_[index] = triangle;
          grid_.distance_m[index] = static_cast<float>(is_inside ? -distance_m : distance_m);
        }
  }

  bool isInside(const Vec3& place_m, bool counts) {
    const double number = body_.winding(place_m);
    if (!counts) return number > kInside;
    ++winding_.samples;
    winding_.lowest = std::min(winding_.lowest, number);
    winding_.highest = std::max(winding_.highest, number);
    if (number >= kUnclearFrom && number <= kUnclearTo) ++winding_.unclear;
    if (std::abs(number - kInside) < winding_.unclearest) {
      winding_.unclearest = std::abs(number - kInside);
      winding_.unclearest_m = place_m;
    }
    return number > kInside;
  }

  /// Offers the triangles of the neighbours to each far sample, in one of eight orders.
  void spread(unsigned directions) {
    std::array<int, 3> step{}, begin{}, end{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool is_forward = (directions >> axis & 1U) == 0;
      step[axis] = is_forward ? 1 : -1;
      begin[axis] = is_forward ? 0 : grid_.samples[axis] - 1;
      end[axis] = is_forward ? grid_.samples[axis] : -1;
    }
    for (int z = begin[2]; z != end[2]; z += step[2])
      for (int y = begin[1]; y != end[1]; y += step[1])
        for (int x = begin[0]; x != end[0]; x += step[0]) {
          const std::size_t index = grid_.indexOf(x, y, z);
          if (is_far_[index] == 0) continue;
          if (x != begin[0]) offer(index, grid_.indexOf(x - step[0], y, z), x, y, z);
          if (y != begin[1]) offer(index, grid_.indexOf(x, y - step[1], z), x, y, z);
          if (z != begin[2]) offer(index, grid_.indexOf(x, y, z - step[2]), x, y, z);
        }
  }

  void offer(std::size_t index, std::size_t neighbour, int x, int y, int z) {
    const std::uint32_t triangle = nearest_[neighbour];
    if (triangle == nearest_[index]) return;
    const auto distance_m =
        static_cast<float>(std::sqrt(tree_.squaredDistance(grid_.placeOf(x, y, z), triangle)));
    if (distance_m >= std::abs(grid_.distance_m[index])) return;
    nearest_[index] = triangle;
    grid_.distance_m[index] = std::copysign(distance_m, grid_.distance_m[index]);
  }

  const MeshBody& body_;
  const TriangleTree& tree_;
  double band_m_;
  SampledField& grid_;
  std::vector<std::uint32_t> nearest_;  ///< of each sample
  std::vector<std::uint8_t> is_far_;
  std::uint32_t last_ = TriangleTree::kNone;
  WindingRange winding_;
};

constexpr double kMillimetresPerMetre = 1e3;
constexpr std::size_t kMaxPlaces = 200'000;
constexpr std::uint32_t kMaxRays = 20'000;

/// An edge with the triangle that it belongs to.
struct EdgeOfFace {
  std::uint32_t low, high, face;
  auto operator<=>(const EdgeOfFace&) const = default;
};

std::vector<EdgeOfFace> edgesOf(const MeshBody& body) {
  std::vector<EdgeOfFace> edges;
  for (std::uint32_t face = 0; face < body.surfaceMesh().triangles.size(); ++face) {
    const Triangle& t = body.surfaceMesh().triangles[face];
    for (std::size_t i = 0; i < 3; ++i)
      edges.push_back({std::min(t[i], t[(i + 1) % 3]), std::max(t[i], t[(i + 1) % 3]), face});
  }
  std::ranges::sort(edges);
  return edges;
}

Vec3 areaNormalOf(const MeshBody& body, std::uint32_t face) {
  const auto& c = body.surface().corners_m(face);
  return 0.5 * cross(c[1] - c[0], c[2] - c[0]);
}

Vec3 centreOf(const MeshBody& body, std::uint32_t face) {
  const auto& c = body.surface().corners_m(face);
  return (1.0 / 3) * (c[0] + c[1] + c[2]);
}

/// A place on the mesh, and the sum of the normals of the faces there.
struct PlaceOnMesh {
  Vec3 place_m, outward;
};

std::vector<PlaceOnMesh> allPlacesOn(const MeshBody& body, const std::vector<EdgeOfFace>& edges) {
  const auto unitNormalOf = [&](std::uint32_t face) {
    const Vec3 normal = areaNormalOf(body, face);
    return norm(normal) > 0 ? (1 / norm(normal)) * normal : Vec3{};
  };
  const std::vector<Vec3>& points_m = body.surfaceMesh().points_m;
  std::vector<PlaceOnMesh> at_points(points_m.size()), places;
  for (std::uint32_t face = 0; face < body.surfaceMesh().triangles.size(); ++face) {
    const Vec3 normal = unitNormalOf(face);
    for (const std::uint32_t corner : body.surfaceMesh().triangles[face]) at_points[corner].outward += normal;
    places.push_back({centreOf(body, face), normal});
  }
  for (std::size_t i = 0; i < points_m.size(); ++i)
    if (norm(at_points[i].outward) > 0) places.push_back({points_m[i], at_points[i].outward});
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const bool is_same = i > 0 && edges[i].low == edges[i - 1].low && edges[i].high == edges[i - 1].high;
    if (!is_same) places.push_back({0.5 * (points_m[edges[i].low] + points_m[edges[i].high]), {}});
    places.back().outward += unitNormalOf(edges[i].face);
  }
  return places;
}

/// Centres of faces, points and middles of edges where the error is measured, without those that other parts
/// of the mesh cover; every n-th of them where there are many.
std::vector<Vec3> placesOn(const MeshBody& body, const std::vector<EdgeOfFace>& edges) {
  constexpr double kOff_m = 1e-6;
  constexpr double kCovered = 0.8;  // the winding number next to an uncovered face is about 0
  const std::vector<PlaceOnMesh> places = allPlacesOn(body, edges);
  const std::size_t step = (places.size() + kMaxPlaces - 1) / kMaxPlaces;
  std::vector<Vec3> chosen;
  for (std::size_t i = 0; i < places.size(); i += step) {
    const double length = norm(places[i].outward);
    const Vec3 off_m = length > 0 ? (kOff_m / length) * places[i].outward : Vec3{};
    if (body.winding(places[i].place_m + off_m) < kCovered) chosen.push_back(places[i].place_m);
  }
  return chosen;
}

/// The spacing with which the trilinear error at nearly all edges is within the tolerance: on a curved
/// surface it is h^2 (k1 + k2) / 8, at an edge up to 0.32 h times its angle over a right angle. Where it is
/// not, the measurement tells.
double expectedSpacing(const MeshBody& body, const std::vector<EdgeOfFace>& edges, double tolerance_m) {
  constexpr double kErrorAtRightAngle = 0.32;
  std::vector<double> spacings;
  for (std::size_t i = 1; i < edges.size(); ++i) {
    if (edges[i].low != edges[i - 1].low || edges[i].high != edges[i - 1].high) continue;
    const Vec3 a = areaNormalOf(body, edges[i].face), b = areaNormalOf(body, edges[i - 1].face);
    const double angle = std::atan2(norm(cross(a, b)), dot(a, b));
    const double apart_m = norm(centreOf(body, edges[i].face) - centreOf(body, edges[i - 1].face));
    if (!(angle > 1e-6)) continue;
    const double at_edge_m = tolerance_m / (kErrorAtRightAngle * angle / (std::numbers::pi / 2));
    const double on_curve_m = std::sqrt(8 * tolerance_m * apart_m / angle);
    spacings.push_back(std::min(at_edge_m, on_curve_m));
  }
  if (spacings.empty()) return std::numeric_limits<double>::infinity();
  const auto low = spacings.begin() + static_cast<std::ptrdiff_t>(spacings.size() / 20);
  std::ranges::nth_element(spacings, low);
  return *low;
}

/// Where a ray from a face into the body leaves it soonest, through a face that looks the other way.
std::optional<ThinPlace> thinnestPlace(const MeshBody& body) {
  constexpr double kOpposite =
      -0.7;  // normals within 45 degrees of opposite ones: not the two sides of an edge
  constexpr double kBeyond = 0.01;
  const auto isOutside = [&](const Vec3& place_m) { return body.winding(place_m) < 0.5; };
  std::optional<ThinPlace> thinnest;
  const auto faces = static_cast<std::uint32_t>(body.surfaceMesh().triangles.size());
  const std::uint32_t step = (faces + kMaxRays - 1) / kMaxRays;
  for (std::uint32_t face = 0; face < faces; face += step) {
    const Vec3 normal = areaNormalOf(body, face), from_m = centreOf(body, face);
    if (!(norm(normal) > 0)) continue;
    const Vec3 outward = (1 / norm(normal)) * normal;
    const auto hit = body.surface().firstHit(from_m, -outward, face);
    if (!hit || (thinnest && hit->distance_m >= thinnest->thickness_m)) continue;
    const Vec3 other = areaNormalOf(body, hit->triangle);
    if (dot(outward, other) > kOpposite * norm(other)) continue;
    // a face that another part of the mesh covers is not a wall
    const double beyond_m = kBeyond * hit->distance_m;
    if (!isOutside(from_m + beyond_m * outward) ||
        !isOutside(from_m - (hit->distance_m + beyond_m) * outward))
      continue;
    thinnest = ThinPlace{hit->distance_m, from_m - 0.5 * hit->distance_m * outward};
  }
  return thinnest;
}

/// Where the search for a spacing begins.
double firstSpacing(const Bounds& box, double expected_m, const std::optional<ThinPlace>& thinnest,
                    double finest_m, double tolerance_m) {
  constexpr double kCoarsest_m = 0.005, kSamplesAcross = 32;
  double spacing_m = std::min({expected_m, kCoarsest_m, box.diagonal_m() / kSamplesAcross});
  // A sheet needs two spacings. One that is thinner than the tolerance is reported instead.
  if (thinnest && thinnest->thickness_m > tolerance_m)
    spacing_m = std::min(spacing_m, thinnest->thickness_m / 2);
  return std::max(spacing_m, finest_m);
}

base::Result<void> checkWinding(const WindingRange& winding, double largest_share, const std::string& name) {
  if (winding.unclearShare() <= largest_share) return {};
  return refused(
      name,
      fmt::format(
          "what is inside is unclear at {:.2f} % of the samples near the surface (allowed: {:.1f} %), first "
          "of all at {}; the winding number is {:.2f}..{:.2f}",
          100 * winding.unclearShare(), 100 * kMaxUnclearShare, millimetreText(winding.unclearest_m),
          winding.lowest, winding.highest),
      "close the holes in 3D Slicer (Surface Toolbox, Fill holes) or export a closed surface of the segment");
}

void addWarnings(const Topology& topology, MeshField& result) {
  auto& warnings = result.report.warnings;
  if (result.turned_faces > 0)
    warnings.push_back(fmt::format("{} faces were inside out and have been turned", result.turned_faces));
  if (result.hidden_faces + result.cut_faces > 0)
    warnings.push_back(
        fmt::format("parts of the mesh overlap: {} faces lie inside others and are ignored, {} in part",
                    result.hidden_faces, result.cut_faces));
  if (topology.duplicate_faces_removed > 0)
    warnings.push_back(fmt::format("{} duplicate faces were removed", topology.duplicate_faces_removed));
  if (!topology.holes.empty()) {
    const Hole& widest = topology.holes.front();
    warnings.push_back(
        fmt::format("the mesh is open at {} edges in {} holes; the widest is {:.1f} mm wide, at {}; it is "
                    "closed by a smooth lid",
                    topology.boundary_edges, topology.holes.size(), widest.extent_m * kMillimetresPerMetre,
                    millimetreText(widest.centre_m)));
  }
  const double least_m = 2 * result.field.spacing_m;
  if (result.thinnest && result.thinnest->thickness_m < least_m)
    warnings.push_back(fmt::format(
        "the body is {:.2f} mm thick at {}, and a spacing of {:.2f} mm resolves walls of {:.2f} mm: it may "
        "be pierced there; "
        "thicken it (Segment Editor, Margin), or choose a smaller tolerance",
        result.thinnest->thickness_m * kMillimetresPerMetre, millimetreText(result.thinnest->place_m),
        result.field.spacing_m * kMillimetresPerMetre, least_m * kMillimetresPerMetre));
}

/// Samples the distance, as long as there is effort left.
base::Result<WindingRange> sampled(const MeshBody& body, Effort& effort, double band_m,
                                   FarSamples far_samples, const std::string& name, SampledField& field) {
  constexpr std::uint64_t kStepsOfSample = 500;  // several times what clean meshes take
  const bool is_left = effort.left > 0;
  if (is_left) effort.left += kStepsOfSample * field.count();
  const WindingRange winding = sampleMesh(body, band_m, field, far_samples);
  if (is_left && effort.left > 0) return winding;
  return refused(name, "its faces cross each other in too many places for what is inside to be found",
                 "join its parts to one closed surface in the program that wrote it");
}

/// Refuses a mesh that is nothing but holes before anything that takes long.
base::Result<void> checkCoarsely(const MeshBody& body, Effort& effort, const Bounds& box,
                                 const std::string& name) {
  if (body.isClosed()) return {};
  constexpr double kSamplesAcross = 32;
  constexpr double kSurely = 4;  // times the share at which the fine samples decide
  const double spacing_m = box.diagonal_m() / kSamplesAcross, band_m = 2 * spacing_m;
  SampledField coarse = gridAbout(box.low_m, box.high_m, band_m, spacing_m);
  const auto winding = sampled(body, effort, band_m, FarSamples::exact_sign, name, coarse);
  if (!winding) return std::unexpected(winding.error());
  return checkWinding(*winding, kSurely * kMaxUnclearShare, name);
}

/// How far the surface that the consumer reads lies from that of the file.
SurfaceError errorOf(const SampledField& field, const MeshBody& body, const std::vector<Vec3>& places,
                     const FieldOptions& options) {
  SurfaceError error = surfaceError(field, places, {}, options.reader);
  error.max_m += body.error_m();
  return error;
}

/// Samples the whole grid, whose spacing is found.
base::Result<MeshField> finish(const MeshBody& body, Effort& effort, const Topology& topology,
                               const std::vector<Vec3>& places, const std::string& name,
                               const FieldOptions& options, MeshField result) {
  const auto winding =
      sampled(body, effort, result.report.band_m, FarSamples::nearly_exact, name, result.field);
  if (!winding) return std::unexpected(winding.error());
  result.winding = *winding;
  if (auto done = checkWinding(result.winding, kMaxUnclearShare, name); !done)
    return std::unexpected(done.error());
  if (std::ranges::none_of(result.field.distance_m, [](float distance) { return distance < 0; }))
    return refused(name, "encloses nothing", "export a closed surface, and thicken what is a sheet");
  result.report.surface = errorOf(result.field, body, places, options);
  addWarnings(topology, result);
  return result;
}

}  // namespace

WindingRange sampleMesh(const MeshBody& body, double band_m, SampledField& grid, FarSamples far_samples) {
  return MeshSampling(body, band_m, grid).run(far_samples);
}

base::Result<MeshField> fieldOfMesh(TriangleMesh mesh, const std::string& name, const FieldOptions& options) {
  if (auto done = checkOptions(options, name); !done) return std::unexpected(done.error());
  const Topology topology = repair(mesh);
  if (mesh.triangles.empty()) return refused(name, "contains no face", "export the surface of the segment");
  if (!(mesh.error_m < options.tolerance_m))
    return refused(
        name,
        fmt::format("its faces bend between their corners, and so are uncertain by {:.4f} mm (allowed: "
                    "{:.4f} mm)",
                    mesh.error_m * kMillimetresPerMetre, options.tolerance_m * kMillimetresPerMetre),
        "export the mesh as triangles, or allow a larger tolerance");
  const Bounds box = boundsOf(mesh.points_m);
  constexpr std::uint64_t kBytesOfTriangle = 50;  // of a binary STL file
  Effort effort{mostSteps(kBytesOfTriangle * mesh.triangles.size())};
  MeshBody body(std::move(mesh), &effort);
  if (auto done = checkCoarsely(body, effort, box, name); !done) return std::unexpected(done.error());
  body.uncover();
  MeshField result;
  result.turned_faces = body.turnedFaces();
  result.hidden_faces = body.hiddenFaces();
  result.cut_faces = body.cutFaces();
  result.thinnest = thinnestPlace(body);
  result.report.finest_spacing_m = finestSpacing(box.low_m, box.high_m, options);
  if (!(result.report.finest_spacing_m <= box.diagonal_m()))
    return refused(name, "the limits allow no grid about the body",
                   "crop the body, or choose a smaller clearance");
  const std::vector<EdgeOfFace> edges = edgesOf(body);
  const std::vector<Vec3> places = placesOn(body, edges);
  SpacingSearch search(firstSpacing(box, expectedSpacing(body, edges, options.tolerance_m), result.thinnest,
                                    result.report.finest_spacing_m, options.tolerance_m),
                       result.report.finest_spacing_m, options.tolerance_m);
  constexpr int kMaxRounds = 30;  // the spacing falls by at least a tenth each time
  constexpr double kReach = 3;    // samples next to the surface that a consumer may read, in spacings
  for (int round = 0; round < kMaxRounds; ++round) {
    const double spacing_m = search.spacing_m();
    result.report.band_m = bandOf(options, spacing_m);
    result.field = gridAbout(box.low_m, box.high_m, result.report.band_m, spacing_m);
    if (auto done = sampled(body, effort, kReach * spacing_m, FarSamples::exact_sign, name, result.field);
        !done)
      return std::unexpected(done.error());
    const auto is_done = search.take(errorOf(result.field, body, places, options), name);
    if (!is_done) return std::unexpected(is_done.error());
    if (*is_done) return finish(body, effort, topology, places, name, options, std::move(result));
  }
  return refused(name, "no spacing was found", "choose a larger tolerance");
}

}  // namespace hapticd::solids
