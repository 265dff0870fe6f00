// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/field/mesh_body.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace hapticd::solids {
namespace {

using rt::Vec3;
using Corners = std::array<Vec3, 3>;

std::array<Vec3, 3> cornersOf(const TriangleMesh& mesh, const Triangle& t) {
  return {mesh.points_m[t[0]], mesh.points_m[t[1]], mesh.points_m[t[2]]};
}

/// An edge as one of its faces runs through it.
struct DirectedEdge {
  std::uint32_t low, high, face;
  bool is_forward;  ///< from low to high
  auto operator<=>(const DirectedEdge&) const = default;
};

/// Calls visit with the edges between the same points, for each pair of points.
template <typename Visit>
void forEachEdge(const TriangleMesh& mesh, Visit visit) {
  std::vector<DirectedEdge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (std::uint32_t face = 0; face < mesh.triangles.size(); ++face)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t from = mesh.triangles[face][i], to = mesh.triangles[face][(i + 1) % 3];
      edges.push_back({std::min(from, to), std::max(from, to), face, from < to});
    }
  std::ranges::sort(edges);
  for (std::size_t begin = 0; begin < edges.size();) {
    std::size_t end = begin;
    while (end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high)
      ++end;
    visit(std::span<const DirectedEdge>(edges).subspan(begin, end - begin));
    begin = end;
  }
}

bool isClosedMesh(const TriangleMesh& mesh) {
  bool is_closed = true;
  forEachEdge(mesh, [&](std::span<const DirectedEdge> same) {
    const auto forward = static_cast<std::size_t>(std::ranges::count(same, true, &DirectedEdge::is_forward));
    is_closed = is_closed && 2 * forward == same.size();
  });
  return is_closed;
}

/// The faces of each part: those that edges of two faces connect. Within a part all agree about the outside
/// as `is_turned` says, unless the surface has one side only.
struct Parts {
  std::vector<std::vector<std::uint32_t>> faces;
  std::vector<bool> is_turned;  ///< by face
};

Parts partsOf(const TriangleMesh& mesh) {
  std::vector<std::vector<std::pair<std::uint32_t, bool>>> neighbours(mesh.triangles.size());
  forEachEdge(mesh, [&](std::span<const DirectedEdge> same) {
    if (same.size() != 2) return;
    const bool agrees = same[0].is_forward != same[1].is_forward;
    neighbours[same[0].face].emplace_back(same[1].face, agrees);
    neighbours[same[1].face].emplace_back(same[0].face, agrees);
  });
  Parts parts{{}, std::vector<bool>(mesh.triangles.size())};
  std::vector<bool> is_reached(mesh.triangles.size());
  for (std::uint32_t first = 0; first < mesh.triangles.size(); ++first) {
    if (is_reached[first]) continue;
    is_reached[first] = true;
    std::vector<std::uint32_t> part{first};
    std::size_t turned = 0;
    for (std::size_t i = 0; i < part.size(); ++i)
      for (const auto& [face, agrees] : neighbours[part[i]]) {
        if (is_reached[face]) continue;
        is_reached[face] = true;
        parts.is_turned[face] = parts.is_turned[part[i]] != !agrees;
        turned += parts.is_turned[face] ? 1U : 0U;
        part.push_back(face);
      }
    // most faces of a part stay as they are
    if (2 * turned > part.size())
      for (const std::uint32_t face : part) parts.is_turned[face] = !parts.is_turned[face];
    parts.faces.push_back(std::move(part));
  }
  return parts;
}

/// Turns the faces that disagree with most of their part, and then the parts that wind about their own faces
/// in the wrong direction. Returns the number of faces that were turned.
std::size_t orient(TriangleMesh& mesh, Parts parts, Effort* effort) {
  const std::vector<Triangle> original = mesh.triangles;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    if (parts.is_turned[i]) std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
  const TriangleTree tree(mesh, effort);
  for (const std::vector<std::uint32_t>& part : parts.faces) {
    double sum = 0;
    for (const std::uint32_t i : part) {
      const auto c = cornersOf(mesh, mesh.triangles[i]);
      // on the surface of a body that is properly oriented it is 1/2, on one that is inside out -1/2
      sum += norm(cross(c[1] - c[0], c[2] - c[0])) * tree.winding((1.0 / 3) * (c[0] + c[1] + c[2]), i);
    }
    if (!(sum < 0)) continue;
    for (const std::uint32_t i : part) parts.is_turned[i] = !parts.is_turned[i];
  }
  std::size_t turned = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    mesh.triangles[i] = original[i];
    if (!parts.is_turned[i]) continue;
    std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
    ++turned;
  }
  return turned;
}

/// The part of the surface that other parts of the mesh do not cover.
class Uncovering {
 public:
  Uncovering(const TriangleMesh& mesh, const TriangleTree& tree) : mesh_(mesh), tree_(tree) {
    const double diagonal_m = boundsOf(mesh.points_m).diagonal_m();
    coarse_m_ = kCoarseShare * diagonal_m;
    finest_m_ = kFinestShare * diagonal_m;
  }

  TriangleMesh run(std::size_t& hidden, std::size_t& cut) {
    TriangleMesh surface{mesh_.points_m, {}};
    for (face_ = 0; face_ < mesh_.triangles.size() && !tree_.isSpent(); ++face_) {
      pieces_.clear();
      const Cover cover = collect(cornersOf(mesh_, mesh_.triangles[face_]));
      if (cover == Cover::none) surface.triangles.push_back(mesh_.triangles[face_]);
      if (cover == Cover::whole) ++hidden;
      if (cover != Cover::part) continue;
      ++cut;
      for (const Corners& piece : pieces_) {
        const auto first = static_cast<std::uint32_t>(surface.points_m.size());
        surface.points_m.insert(surface.points_m.end(), piece.begin(), piece.end());
        surface.triangles.push_back({first, first + 1, first + 2});
      }
      all_pieces_ += pieces_.size();
    }
    return surface;
  }

 private:
  enum class Cover { none, part, whole };
  static constexpr double kHidden = 1.0;  // between that of the surface, 1/2, and of a face inside, 3/2
  static constexpr double kCoarseShare = 1.0 / 16, kFinestShare = 1.0 / 256;  // of the diagonal of the mesh
  static constexpr std::size_t kMaxPieces = 500'000;

  /// Appends what of a piece of the face is not covered, unless all or nothing of it is.
  Cover collect(const Corners& c) {
    const std::size_t covered = coveredOf(c);
    const double longest_m = std::max({norm(c[1] - c[0]), norm(c[2] - c[1]), norm(c[0] - c[2])});
    // a wide piece is also cut where none of the few places looked at says that it is covered
    const bool is_mixed = longest_m > coarse_m_ || (covered > 0 && covered < kShares.size());
    if (!is_mixed || longest_m <= finest_m_ || all_pieces_ + pieces_.size() > kMaxPieces) {
      if (covered == kShares.size()) return Cover::whole;
      pieces_.push_back(c);
      return covered == 0 ? Cover::none : Cover::part;
    }
    const std::size_t before = pieces_.size();
    const Vec3 ab = 0.5 * (c[0] + c[1]), bc = 0.5 * (c[1] + c[2]), ca = 0.5 * (c[2] + c[0]);
    std::array<std::size_t, 3> count{};
    for (const Corners& quarter :
         {Corners{c[0], ab, ca}, Corners{ab, c[1], bc}, Corners{ca, bc, c[2]}, Corners{ab, bc, ca}})
      ++count[static_cast<std::size_t>(collect(quarter))];
    if (count[static_cast<std::size_t>(Cover::whole)] == 4) return Cover::whole;
    if (count[static_cast<std::size_t>(Cover::none)] != 4) return Cover::part;
    pieces_.resize(before);
    pieces_.push_back(c);
    return Cover::none;
  }

  static constexpr double kOff = 0.02;  // of the corners, which other faces share
  static constexpr std::array<std::array<double, 3>, 7> kShares{{{1.0 / 3, 1.0 / 3, 1.0 / 3},
                                                                 {1 - 2 * kOff, kOff, kOff},
                                                                 {kOff, 1 - 2 * kOff, kOff},
                                                                 {kOff, kOff, 1 - 2 * kOff},
                                                                 {0.5 - kOff / 2, 0.5 - kOff / 2, kOff},
                                                                 {kOff, 0.5 - kOff / 2, 0.5 - kOff / 2},
                                                                 {0.5 - kOff / 2, kOff, 0.5 - kOff / 2}}};

  /// At how many of these places a piece of the face lies inside the rest of the mesh.
  std::size_t coveredOf(const Corners& c) const {
    return static_cast<std::size_t>(std::ranges::count_if(kShares, [&](const std::array<double, 3>& share) {
      return tree_.winding(share[0] * c[0] + share[1] * c[1] + share[2] * c[2], face_) > kHidden;
    }));
  }

  const TriangleMesh& mesh_;
  const TriangleTree& tree_;
  double coarse_m_ = 0, finest_m_ = 0;
  std::uint32_t face_ = 0;
  std::vector<Corners> pieces_;
  std::size_t all_pieces_ = 0;
};

}  // namespace

MeshBody::MeshBody(TriangleMesh mesh, Effort* effort) : effort_(effort), error_m_(mesh.error_m) {
  Parts parts = partsOf(mesh);
  parts_ = parts.faces.size();
  turned_faces_ = orient(mesh, std::move(parts), effort);
  is_closed_ = isClosedMesh(mesh);
  all_ = TriangleTree(mesh, effort);
  surface_mesh_ = std::move(mesh);
  surface_ = all_;
}

void MeshBody::uncover() {
  if (parts_ == 1) return;  // nothing else could cover it
  TriangleMesh surface = Uncovering(surface_mesh_, all_).run(hidden_faces_, cut_faces_);
  if (surface.triangles.empty()) {
    hidden_faces_ = cut_faces_ = 0;
    return;
  }
  surface_mesh_ = std::move(surface);
  surface_ = TriangleTree(surface_mesh_, effort_);
}

}  // namespace hapticd::solids
