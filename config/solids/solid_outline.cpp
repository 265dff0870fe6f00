// SPDX-License-Identifier: Apache-2.0
#include "config/solids/solid_outline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

namespace hapticd::config {
namespace {

/// Cells along each side of a plane, from fine to coarse: the first that does not take too many points.
constexpr std::array<std::uint32_t, 7> kCells{48, 36, 27, 20, 15, 11, 8};
/// The longest line passes each edge of the cells once, and a line of four edges repeats its first point.
static_assert(3 * kMaxOutlinePlanes * (2 * kCells.back() * (kCells.back() + 1)) * 5 / 4 <= kMaxOutlinePoints);
/// Halvings of the edge of a cell on which the boundary is searched.
constexpr int kHalvings = 12;
/// A coefficient of a quadratic B-spline has an effect so many samples to each side.
constexpr double kSupport = 1.5;

double& component(rt::Vec3& vector, std::size_t axis) {
  return (&vector.x)[axis];
}

/// The smallest box of samples with all coefficients below zero.
struct Box {
  std::array<std::uint32_t, 3> first{rt::kMaxGridSamples, rt::kMaxGridSamples, rt::kMaxGridSamples};
  std::array<std::uint32_t, 3> last{};

  bool isEmpty() const { return first[0] > last[0]; }
  void include(std::uint32_t sample, std::size_t axis) {
    first[axis] = std::min(first[axis], sample);
    last[axis] = std::max(last[axis], sample);
  }
};

Box boxOf(const rt::DistanceGrid& grid) {
  const auto [nx, ny, nz] = grid.samples;
  const auto is_inside = [](std::int16_t coefficient) { return coefficient < 0; };
  Box box;
  for (std::uint32_t z = 0; z < nz; ++z) {
    for (std::uint32_t y = 0; y < ny; ++y) {
      const std::span row(grid.coefficients + (std::size_t{z} * ny + y) * nx, nx);
      std::int16_t least = 0;  // without branches, so that most rows are passed at the speed of memory
      for (const std::int16_t coefficient : row) least = std::min(least, coefficient);
      if (least == 0) continue;
      const auto begin = std::ranges::find_if(row, is_inside);
      const auto end = std::find_if(row.rbegin(), row.rend(), is_inside);
      box.include(static_cast<std::uint32_t>(begin - row.begin()), 0);
      box.include(static_cast<std::uint32_t>(row.rend() - end - 1), 0);
      box.include(y, 1);
      box.include(z, 2);
    }
  }
  return box;
}

/// The boundary in one plane, by marching squares. Nodes of cells at the rim of the plane count as outside,
/// so that each line is closed.
class Plane {
 public:
  /// `at`: of the plane along `axis`; `first` and `step`: of the nodes along each axis; samples. `cells`:
  /// along each axis.
  Plane(const rt::DistanceGrid& grid, std::size_t axis, double at, const std::array<double, 3>& first,
        const std::array<double, 3>& step, const std::array<std::uint32_t, 3>& cells)
      : grid_(grid),
        u_((axis + 1) % 3),
        v_((axis + 2) % 3),
        nodes_u_(cells[u_] + 1),
        nodes_v_(cells[v_] + 1),
        corner_m_(grid.origin_m) {
    component(corner_m_, axis) += grid.spacing_m * at;
    for (const std::size_t side : {u_, v_}) {
      component(corner_m_, side) += grid.spacing_m * first[side];
      component(side == u_ ? along_u_m_ : along_v_m_, side) = grid.spacing_m * step[side];
    }
  }

  void addLinesTo(std::vector<OutlineLine>& lines) {
    findInside();
    linkEdges();
    for (std::size_t edge = 0; edge < links_.size(); ++edge) {
      if (links_[edge][0] != kNone) lines.push_back(lineFrom(edge));
    }
  }

 private:
  static constexpr std::size_t kNone = SIZE_MAX;
  /// The edges that a line comes from and goes to.
  using Link = std::array<std::size_t, 2>;

  std::size_t nodes() const { return std::size_t{nodes_u_} * nodes_v_; }
  std::size_t node(std::uint32_t i, std::uint32_t j) const { return std::size_t{j} * nodes_u_ + i; }
  /// From a node to its neighbour along u, and along v.
  std::size_t edgeAlongU(std::uint32_t i, std::uint32_t j) const { return node(i, j); }
  std::size_t edgeAlongV(std::uint32_t i, std::uint32_t j) const { return nodes() + node(i, j); }
  rt::Vec3 place_m(double i, double j) const { return corner_m_ + i * along_u_m_ + j * along_v_m_; }
  bool isInside(double i, double j) const { return rt::distanceAt(grid_, place_m(i, j)).distance_m < 0; }

  void findInside() {
    inside_.assign(nodes(), 0);
    for (std::uint32_t j = 1; j + 1 < nodes_v_; ++j) {
      for (std::uint32_t i = 1; i + 1 < nodes_u_; ++i) inside_[node(i, j)] = isInside(i, j) ? 1 : 0;
    }
  }

  void link(std::size_t edge, std::size_t other) {
    links_[edge][links_[edge][0] == kNone ? 0 : 1] = other;
    links_[other][links_[other][0] == kNone ? 0 : 1] = edge;
  }

  void linkEdges() {
    links_.assign(2 * nodes(), {kNone, kNone});
    for (std::uint32_t j = 0; j + 1 < nodes_v_; ++j) {
      for (std::uint32_t i = 0; i + 1 < nodes_u_; ++i) linkEdgesOf(i, j);
    }
  }

  /// Connects the edges of one cell that the boundary crosses.
  void linkEdgesOf(std::uint32_t i, std::uint32_t j) {
    // around the cell: corner k is between the edges k and (k + 3) % 4
    const std::array corners{inside_[node(i, j)], inside_[node(i + 1, j)], inside_[node(i + 1, j + 1)],
                             inside_[node(i, j + 1)]};
    const std::array edges{edgeAlongU(i, j), edgeAlongV(i + 1, j), edgeAlongU(i, j + 1), edgeAlongV(i, j)};
    std::array<std::size_t, 4> crossed{};
    std::size_t count = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      if (corners[k] != corners[(k + 1) % 4]) crossed[count++] = edges[k];
    }
    if (count == 2) link(crossed[0], crossed[1]);
    if (count != 4) return;
    // two opposite corners are inside: the middle decides whether they are connected
    const bool around_second = (corners[0] != 0) == isInside(i + 0.5, j + 0.5);
    link(crossed[0], crossed[around_second ? 1 : 3]);
    link(crossed[2], crossed[around_second ? 3 : 1]);
  }

  /// The line through an edge, whose links are taken away.
  OutlineLine lineFrom(std::size_t start) {
    OutlineLine line{crossing_m(start)};
    std::size_t from = kNone, at = start;
    do {
      const Link next = std::exchange(links_[at], {kNone, kNone});
      const std::size_t to = next[0] == from ? next[1] : next[0];
      from = std::exchange(at, to);
      if (at != start) line.push_back(crossing_m(at));
    } while (at != start);
    line.push_back(line.front());
    return line;
  }

  rt::Vec3 crossing_m(std::size_t edge) const {
    const bool along_v = edge >= nodes();
    const std::size_t first = edge % nodes();
    const auto i = static_cast<std::uint32_t>(first % nodes_u_);
    const auto j = static_cast<std::uint32_t>(first / nodes_u_);
    const auto placeOf = [&](double share) {
      return std::array{i + (along_v ? 0 : share), j + (along_v ? share : 0)};
    };
    const bool begins_inside = inside_[first] != 0;
    double low = 0, high = 1;
    for (int k = 0; k < kHalvings; ++k) {
      const double middle = (low + high) / 2;
      const auto [at_i, at_j] = placeOf(middle);
      (isInside(at_i, at_j) == begins_inside ? low : high) = middle;
    }
    const auto [at_i, at_j] = placeOf((low + high) / 2);
    return place_m(at_i, at_j);
  }

  const rt::DistanceGrid& grid_;
  const std::size_t u_, v_;
  const std::uint32_t nodes_u_, nodes_v_;
  rt::Vec3 corner_m_;
  rt::Vec3 along_u_m_{}, along_v_m_{};
  std::vector<std::uint8_t> inside_;  // of each node
  std::vector<Link> links_;           // of each edge
};

/// The outline with at most so many cells along each axis; nothing: it has too many points.
std::optional<std::vector<OutlineLine>> outlineWith(std::uint32_t most_cells, const rt::DistanceGrid& grid,
                                                    const Box& box) {
  // Beyond this much around the box all coefficients that the spline reads are at least zero, so it is too.
  std::array<double, 3> first{}, step{};
  std::array<std::uint32_t, 3> cells{}, length{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    length[axis] = box.last[axis] - box.first[axis] + 1;
    cells[axis] = std::min(most_cells, length[axis] + 2);
    first[axis] = box.first[axis] - kSupport;
    step[axis] = (length[axis] - 1 + 2 * kSupport) / cells[axis];
  }
  std::vector<OutlineLine> lines;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint32_t planes = std::min(kMaxOutlinePlanes, length[axis]);
    for (std::uint32_t i = 0; i < planes; ++i) {
      const double at = box.first[axis] - 0.5 + (i + 0.5) * length[axis] / planes;
      Plane(grid, axis, at, first, step, cells).addLinesTo(lines);
    }
    std::size_t points = 0;
    for (const OutlineLine& line : lines) points += line.size();
    if (points > kMaxOutlinePoints) return std::nullopt;
  }
  return lines;
}

}  // namespace

std::vector<OutlineLine> outlineOf(const rt::DistanceGrid& grid) {
  const Box box = boxOf(grid);
  if (box.isEmpty()) return {};
  for (const std::uint32_t cells : kCells) {
    if (auto lines = outlineWith(cells, grid, box)) return std::move(*lines);
  }
  return {};  // not reached: the coarsest cells take fewer points
}

}  // namespace hapticd::config
