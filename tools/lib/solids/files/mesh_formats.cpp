// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/files/mesh_formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "tools/lib/solids/files/source_file.h"

namespace hapticd::solids {

using rt::Vec3;

std::string takeSpaceNote(FileMesh& mesh, std::string_view text) {
  constexpr std::string_view kKey = "SPACE=";
  const std::size_t at = text.find(kKey);
  if (at == std::string_view::npos) return {};
  const std::string_view value = text.substr(at + kKey.size());
  const auto is_part = [](char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '-'; };
  const std::string space(value.begin(), std::ranges::find_if_not(value, is_part));
  if (!mesh.space.empty() && space != mesh.space)
    return fmt::format("SPACE={} in a file that has SPACE={} above", space, mesh.space);
  mesh.space = space;
  return {};
}

/// Of an outline seen against its normal: the inside is on the left.
struct Polygons::Corner {
  double u, v;
  std::uint32_t point, before, next;
};

namespace {

/// Twice the area of a triangle; negative if it is clockwise.
template <typename Corner>
double turnOf(const Corner& a, const Corner& b, const Corner& c) {
  return (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u);
}

/// How often an outline goes round, to the left: once if it does not cross itself.
template <typename Corner>
long turnsOf(const std::vector<Corner>& outline) {
  const auto differs = [](const Corner& a, const Corner& b) { return a.u != b.u || a.v != b.v; };
  double angle = 0;
  const Corner* before = &outline.back();
  for (auto last = outline.rbegin() + 1; last != outline.rend() && !differs(*before, outline.front()); ++last)
    before = &*last;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Corner &at = outline[i], &next = outline[(i + 1) % outline.size()];
    if (!differs(at, next)) continue;  // the same corner twice
    angle += std::atan2(turnOf(*before, at, next),
                        (at.u - before->u) * (next.u - at.u) + (at.v - before->v) * (next.v - at.v));
    before = &at;
  }
  return std::lround(angle / (2 * std::numbers::pi));
}

constexpr const char* kCrosses = "its outline crosses itself";
constexpr double kFlat = 1e-13;  // of the squared extent of a face: areas below it are rounding

}  // namespace

Polygons::Polygons(FileMesh& mesh, const MeshLimits& limits, std::size_t file_bytes)
    : mesh_(mesh), limits_(limits), steps_left_(mostSteps(file_bytes)) {}

std::string Polygons::add(std::span<const std::uint64_t> corners) {
  if (corners.size() < 3) return fmt::format("a face has {} corners (allowed: at least 3)", corners.size());
  for (const std::uint64_t corner : corners)
    if (corner >= mesh_.points.size())
      return fmt::format("a face names point {} of {}, counted from 1", corner + 1, mesh_.points.size());
  if (mesh_.triangles.size() + corners.size() - 2 > limits_.triangles)
    return fmt::format("more than {} triangles", limits_.triangles);
  const auto count = static_cast<std::uint32_t>(corners.size());
  const Vec3 first = mesh_.points[corners[0]];
  const auto place = [&](std::uint32_t i) { return mesh_.points[corners[i % count]] - first; };
  Vec3 normal;
  double extent = 0, widest = 0;
  for (std::uint32_t i = 1; i < count; ++i) {
    const Vec3 twice_area = cross(place(i), place(i + 1));
    normal += twice_area;
    widest = std::max(widest, norm(twice_area));
    extent = std::max(extent, norm(place(i)));
  }
  const double length = norm(normal), flat = kFlat * extent * extent;
  if (count == 3 || widest <= flat) {  // nothing to decide
    for (std::uint32_t i = 2; i < count; ++i)
      mesh_.triangles.push_back({static_cast<std::uint32_t>(corners[0]),
                                 static_cast<std::uint32_t>(corners[i - 1]),
                                 static_cast<std::uint32_t>(corners[i])});
    return {};
  }
  double low = 0, high = 0;
  std::vector<Corner> outline;
  const Vec3 size{std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)};
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec3 p = place(i);
    low = std::min(low, dot(p, normal) / length);
    high = std::max(high, dot(p, normal) / length);
    // seen along the axis that the normal is nearest to, which leaves the coordinates as they are
    const bool along_x = size.x >= size.y && size.x >= size.z, along_y = !along_x && size.y >= size.z;
    const double along = along_x ? normal.x : along_y ? normal.y : normal.z;
    const double u = along_x ? p.y : along_y ? p.z : p.x, v = along_x ? p.z : along_y ? p.x : p.y;
    outline.push_back({along < 0 ? v : u, along < 0 ? u : v, static_cast<std::uint32_t>(corners[i]),
                       (i + count - 1) % count, (i + 1) % count});
  }
  if (!(length > flat) || turnsOf(outline) != 1) return kCrosses;
  mesh_.bend = std::max(mesh_.bend, high - low);
  flat_ = flat;
  return cutEars(outline);
}

std::string Polygons::cutEars(std::vector<Corner>& outline) {
  const auto isHollow = [&](std::uint32_t at) {
    const Corner& c = outline[at];
    return turnOf(outline[c.before], c, outline[c.next]) <= flat_;
  };
  const auto cut = [&](const Corner& c) {
    mesh_.triangles.push_back({outline[c.before].point, c.point, outline[c.next].point});
  };
  hollow_.clear();
  for (std::uint32_t i = 0; i < outline.size(); ++i)
    if (isHollow(i)) hollow_.push_back(i);
  // Where no ear is left, one may touch the outline, as at the bridges to holes, and then corners between
  // edges in one line are cut. No triangle is ever clockwise, so together they cover what the outline
  // surrounds, once.
  int lenience = 0;
  std::size_t tried = 0;
  std::uint32_t at = 0;
  for (std::size_t left = outline.size(); left > 3;) {
    const Corner corner = outline[at];
    const std::uint64_t steps = 1 + hollow_.size();
    if (steps > steps_left_)
      return "its outline is too intricate: divide it into triangles before the mesh is exported";
    steps_left_ -= steps;
    const std::uint32_t tip = std::exchange(at, corner.next);
    const bool is_ear = isEar(outline, tip, lenience);
    if (!is_ear) {
      if (++tried < left) continue;
      tried = 0;
      if (++lenience > kMostLenient) return kCrosses;
      continue;
    }
    cut(corner);
    outline[corner.before].next = corner.next;
    outline[corner.next].before = corner.before;
    std::erase_if(hollow_, [&](std::uint32_t i) {
      return i == tip || ((i == corner.before || i == corner.next) && !isHollow(i));
    });
    --left;
    tried = 0;
  }
  if (turnOf(outline[outline[at].before], outline[at], outline[outline[at].next]) < -flat_) return kCrosses;
  cut(outline[at]);
  return {};
}

bool Polygons::isEar(const std::vector<Corner>& outline, std::uint32_t at, int lenience) const {
  const Corner& tip = outline[at];
  const Corner &before = outline[tip.before], &next = outline[tip.next];
  const double turn = turnOf(before, tip, next);
  if (turn <= flat_) return lenience == kMostLenient && turn >= -flat_;
  const auto isAt = [](const Corner& a, const Corner& b) { return a.u == b.u && a.v == b.v; };
  return std::ranges::none_of(hollow_, [&](std::uint32_t i) {
    const Corner& other = outline[i];
    if (isAt(other, before) || isAt(other, next)) return false;
    const auto isBetweenEdges = [&](const Corner& c, double margin) {
      return turnOf(before, tip, c) > margin && turnOf(tip, next, c) > margin;
    };
    if (isAt(other, tip))
      return i != at &&
             (isBetweenEdges(outline[other.before], flat_) || isBetweenEdges(outline[other.next], flat_));
    const double margin = lenience == 0 ? -flat_ : flat_;
    return isBetweenEdges(other, margin) && turnOf(next, before, other) > margin;
  });
}

}  // namespace hapticd::solids
