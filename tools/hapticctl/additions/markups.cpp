// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/additions/markups.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <set>
#include <utility>

#include "config/base/value_text.h"
#include "tools/lib/solids/files/markups_reader.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;
using solids::Markup;
using solids::MarkupKind;

constexpr std::size_t kMaxName = 32;
/// Distance of the points of a path that is made of a curve, where kMaxPathPoints allow it.
constexpr double kPathStep_m = 0.002;

/// A name with what a fixture's name may hold; another one than those in `used`.
std::string nameFor(const std::string& given, std::set<std::string>& used) {
  std::string name;
  for (const char c : given)
    name +=
        std::isalnum(static_cast<unsigned char>(c)) != 0 && static_cast<unsigned char>(c) < 0x80 ? c : '_';
  if (name.empty()) name = "markup";
  name = name.substr(0, kMaxName - 3);
  std::string unique = name;
  for (int i = 2; !used.insert(unique).second; ++i) unique = fmt::format("{}-{}", name, i);
  return unique;
}

/// A place of the curve of Catmull and Rom through four points, between the second and the third.
Vec3 onCurve(const std::array<Vec3, 4>& p, double share) {
  const double s = share, s2 = s * s, s3 = s2 * s;
  return 0.5 * ((-s3 + 2 * s2 - s) * p[0] + (3 * s3 - 5 * s2 + 2) * p[1] + (-3 * s3 + 4 * s2 + s) * p[2] +
                (s3 - s2) * p[3]);
}

/// Points of the curve that 3D Slicer draws through control points.
std::vector<Vec3> pathThrough(const std::vector<Vec3>& control, bool closed) {
  const std::size_t count = control.size();
  const std::size_t pieces = closed ? count : count - 1;
  const auto at = [&](std::ptrdiff_t i) {
    const auto n = static_cast<std::ptrdiff_t>(count);
    return control[static_cast<std::size_t>(closed ? (i % n + n) % n
                                                   : std::clamp<std::ptrdiff_t>(i, 0, n - 1))];
  };
  double length_m = 0;
  for (std::size_t i = 0; i < pieces; ++i) {
    const auto k = static_cast<std::ptrdiff_t>(i);
    length_m += norm(at(k + 1) - at(k));
  }
  const double step_m =
      std::max(kPathStep_m, length_m / static_cast<double>(rt::kMaxPathPoints - pieces - 2));
  std::vector<Vec3> path{at(0)};
  const auto add = [&](const Vec3& point) {
    if (norm(point - path.back()) >= 2 * rt::kMinPointDistance_m) path.push_back(point);
  };
  for (std::size_t i = 0; i < pieces; ++i) {
    const auto k = static_cast<std::ptrdiff_t>(i);
    const std::array<Vec3, 4> around{at(k - 1), at(k), at(k + 1), at(k + 2)};
    const int steps = std::max(1, static_cast<int>(std::floor(norm(around[2] - around[1]) / step_m)));
    for (int s = 1; s <= steps; ++s) add(onCurve(around, static_cast<double>(s) / steps));
  }
  if (closed) path.back() = path.front();
  return path;
}

/// Roll, pitch and yaw of the rotation whose columns these axes are.
Vec3 rotationOf(const std::array<Vec3, 3>& axes) {
  constexpr double kDegPerRad = 180 / std::numbers::pi;
  const auto& [x, y, z] = axes;
  const double yaw = std::atan2(x.y, x.x);
  const double pitch = std::atan2(-x.z, std::hypot(x.x, x.y));
  const double roll =
      std::atan2(std::sin(yaw) * z.x - std::cos(yaw) * z.y, std::cos(yaw) * y.y - std::sin(yaw) * y.x);
  return kDegPerRad * Vec3{roll, pitch, yaw};
}

/// Adds what a markup becomes. Returns the note about it.
std::string addMarkup(const Markup& markup, const std::string& name, std::set<std::string>& used,
                      config::SceneAdditions& additions) {
  const std::string shown = fmt::format("{} {}", textOf(markup.kind), base::inQuotes(name));
  config::FixtureSettings fixture;
  switch (markup.kind) {
    case MarkupKind::line:
    case MarkupKind::curve:
    case MarkupKind::closed_curve: {
      const bool closed = markup.kind == MarkupKind::closed_curve;
      std::vector<Vec3> points;
      for (const solids::MarkupPoint& point : markup.points) points.push_back(point.position_m);
      const std::size_t most = rt::kMaxPathPoints / 2;
      if (points.size() < (closed ? 3U : 2U) || points.size() > most)
        return fmt::format("{}: left out, because it has {} points (2 to {})", shown, points.size(), most);
      fixture.kind = rt::FixtureKind::path;
      fixture.points_m = pathThrough(points, closed);
      break;
    }
    case MarkupKind::plane:
      fixture.kind = rt::FixtureKind::plane;
      fixture.position_m = markup.plane->position_m;
      fixture.normal = markup.plane->normal;
      break;
    case MarkupKind::roi:
      fixture.kind = rt::FixtureKind::box;
      fixture.position_m = markup.box->centre_m;
      fixture.size_m = markup.box->size_m;
      fixture.rotation_deg = rotationOf(markup.box->axes);
      break;
    case MarkupKind::fiducial:
      return fmt::format("{}: {} points for --landmarks", shown, markup.points.size());
    case MarkupKind::angle:
      return fmt::format("{}: left out, because no fixture is an angle", shown);
  }
  fixture.name = nameFor(name, used);
  std::string note = fmt::format("{}: {} {}", shown, rt::wordOf(fixture.kind), fixture.name);
  if (fixture.kind == rt::FixtureKind::plane) note += ", free on the side of its normal";
  additions.fixtures.push_back(std::move(fixture));
  return note;
}

}  // namespace

bool isMarkupFile(std::string_view file) {
  return file.ends_with(".mrk.json") || file.ends_with(".fcsv");
}

base::Result<std::vector<PlacedLandmark>> landmarksOfMarkups(const std::string& file) {
  const auto read = solids::readMarkups(file);
  if (!read) return std::unexpected(read.error());
  std::vector<PlacedLandmark> landmarks;
  std::set<std::string> names;
  for (const Markup& markup : read->markups) {
    if (markup.kind != MarkupKind::fiducial) continue;
    for (const solids::MarkupPoint& point : markup.points) {
      if (!names.insert(point.label).second)
        return std::unexpected(base::Error{file,
                                           fmt::format("has two points {}", base::inQuotes(point.label)),
                                           "give each point a label of its own"});
      landmarks.push_back({point.label, point.position_m});
    }
  }
  if (landmarks.empty())
    return std::unexpected(base::Error{file, "has no points", "place a point list in 3D Slicer and save it"});
  return landmarks;
}

base::Result<MarkupFixtures> fixturesOfMarkups(const std::string& file) {
  const auto read = solids::readMarkups(file);
  if (!read) return std::unexpected(read.error());
  MarkupFixtures result{.additions = {}, .notes = read->warnings};
  std::set<std::string> used;
  const std::string file_name = std::filesystem::path(file).filename().string();
  const std::string stem = file_name.substr(0, file_name.find('.'));
  for (const Markup& markup : read->markups) {
    const std::string& name = markup.name.empty() ? stem : markup.name;
    result.notes.push_back(addMarkup(markup, name, used, result.additions));
  }
  if (result.additions.fixtures.empty())
    return std::unexpected(base::Error{file, "has no line, curve, plane or box that could become a fixture",
                                       "use a file of points with --landmarks"});
  return result;
}

}  // namespace hapticd::tools
