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
#include <span>
#include <utility>

#include "config/base/value_text.h"
#include "tools/lib/registration/touch.h"
#include "tools/lib/solids/files/markups_reader.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;
using solids::Markup;
using solids::MarkupKind;

constexpr std::size_t kMaxName = 32;
constexpr std::size_t kMaxControlPoints = 10'000;
/// A path is made as near to its curve as this, where rt::kMaxPathPoints allow it.
constexpr double kPathTolerance_m = 2e-5;
/// Nearer points are the same one, placed twice.
constexpr double kSamePlace_m = 1e-6;

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

/// The derivatives, at its points, of a cubic spline whose parameter is the number of the point, with
/// continuous curvature and at rest at both ends.
std::vector<Vec3> derivativesAt(const std::vector<Vec3>& points) {
  std::vector<Vec3> slopes(points.size());
  std::vector<double> shares(points.size());
  for (std::size_t i = 1; i + 1 < points.size(); ++i) {
    shares[i] = 1 / (4 - shares[i - 1]);
    slopes[i] = shares[i] * (3 * (points[i + 1] - points[i - 1]) - slopes[i - 1]);
  }
  for (std::size_t i = points.size() - 1; i-- > 1;) slopes[i] = slopes[i] - shares[i] * slopes[i + 1];
  return slopes;
}

/// Points of the curve that 3D Slicer draws through control points: a spline of vtkParametricSpline that is
/// not parameterised by length. `error_m`: how far the curve is from the lines between them.
std::vector<Vec3> curveThrough(std::vector<Vec3> control, bool closed, double& error_m) {
  // A closed curve goes on beyond its ends, whose influence falls to (2 - sqrt 3)^kRound, below rounding.
  constexpr std::ptrdiff_t kRound = 30;
  const auto count = static_cast<std::ptrdiff_t>(control.size());
  const std::ptrdiff_t first = closed ? kRound : 0, pieces = closed ? count : count - 1;
  if (closed) {
    const std::vector<Vec3> once = control;
    control.clear();
    for (std::ptrdiff_t i = -kRound; i <= count + kRound; ++i)
      control.push_back(once[static_cast<std::size_t>((i % count + count) % count)]);
  }
  const std::vector<Vec3> slopes = derivativesAt(control);
  std::vector<Vec3> curve{control[static_cast<std::size_t>(first)]};
  constexpr double kChordError_m = 1e-5, kMostSteps = 64;
  for (auto i = static_cast<std::size_t>(first); i < static_cast<std::size_t>(first + pieces); ++i) {
    const Vec3 along = control[i + 1] - control[i];
    const Vec3 quadratic = 3 * along - 2 * slopes[i] - slopes[i + 1];
    const Vec3 cubic = slopes[i] + slopes[i + 1] - 2 * along;
    const double bend_m = std::max(norm(2 * quadratic), norm(2 * quadratic + 6 * cubic)) / 8;
    const double steps = std::clamp(std::ceil(std::sqrt(bend_m / kChordError_m)), 1.0, kMostSteps);
    error_m = std::max(error_m, bend_m / (steps * steps));
    for (double step = 1; step <= steps; ++step) {
      const double s = step / steps;
      curve.push_back(control[i] + s * (slopes[i] + s * (quadratic + s * cubic)));
    }
  }
  if (closed) curve.back() = curve.front();
  return curve;
}

/// How far the arcs in the bends of a path are from its points.
double bendError_m(const config::FixtureSettings& path) {
  std::vector<rt::PathElement> elements(2 * path.points_m.size());
  elements.resize(rt::smoothPath(path.points_m, path.bend_radius_m, elements));
  double most_m = 0;
  for (const rt::PathElement& element : elements) {
    if (element.curvature_per_m <= 0) continue;
    const double half_turn = element.length_m * element.curvature_per_m / 2;
    most_m = std::max(most_m, (1 / std::cos(half_turn) - 1) / element.curvature_per_m);
  }
  return most_m;
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
  std::string details;
  switch (markup.kind) {
    case MarkupKind::line:
    case MarkupKind::curve:
    case MarkupKind::closed_curve: {
      const bool closed = markup.kind == MarkupKind::closed_curve;
      std::vector<Vec3> points;
      for (const solids::MarkupPoint& point : markup.points) points.push_back(point.position_m);
      const auto repeats = [](const Vec3& a, const Vec3& b) { return norm(a - b) < kSamePlace_m; };
      points.erase(std::unique(points.begin(), points.end(), repeats), points.end());
      if (closed && points.size() > 1 && repeats(points.back(), points.front())) points.pop_back();
      const std::size_t repeated = markup.points.size() - points.size();
      const std::size_t least = closed ? 3 : 2;
      if (points.size() < least || points.size() > kMaxControlPoints)
        return fmt::format("{}: left out, because it has {} points ({} to {})", shown, points.size(), least,
                           kMaxControlPoints);
      fixture.kind = rt::FixtureKind::path;
      double error_m = 0;
      SimplifiedPath path =
          simplifiedPath(curveThrough(std::move(points), closed, error_m), kPathTolerance_m);
      fixture.points_m = std::move(path.points_m);
      error_m += path.deviation_m + bendError_m(fixture);
      details = fmt::format(" of {} points, within {:.3f} mm of the curve that 3D Slicer draws",
                            fixture.points_m.size(), std::ceil(1e6 * error_m) / 1e3);
      if (repeated > 0) details += fmt::format(" without repetitions of a point ({})", repeated);
      break;
    }
    case MarkupKind::plane:
      fixture.kind = rt::FixtureKind::plane;
      fixture.position_m = markup.plane->position_m;
      fixture.normal = markup.plane->normal;
      details = ", free on the side of its normal";
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
  std::string note = fmt::format("{}: {} {}{}", shown, rt::wordOf(fixture.kind), fixture.name, details);
  additions.fixtures.push_back(std::move(fixture));
  return note;
}

/// The beginning of what was noted, for an error.
std::string reasonsIn(const std::vector<std::string>& notes) {
  constexpr std::size_t kMost = 4;
  const std::span some(notes.data(), std::min(notes.size(), kMost));
  return notes.empty() ? ""
                       : fmt::format(" ({}{})", fmt::join(some, "; "), notes.size() > kMost ? "; ..." : "");
}

}  // namespace

base::Result<ModelLandmarks> landmarksOfMarkups(const std::string& file) {
  auto read = solids::readMarkups(file);
  if (!read) return std::unexpected(read.error());
  ModelLandmarks model{.notes = std::move(read->warnings)};
  std::set<std::string> names;
  for (const Markup& markup : read->markups) {
    if (markup.kind != MarkupKind::fiducial) continue;
    for (const solids::MarkupPoint& point : markup.points) {
      if (!names.insert(point.label).second)
        return std::unexpected(base::Error{file,
                                           fmt::format("has two points {}", base::inQuotes(point.label)),
                                           "give each point a label of its own"});
      model.landmarks.push_back({point.label, point.position_m});
    }
    model.unplaced.insert(markup.unplaced.begin(), markup.unplaced.end());
  }
  for (const std::string& name : names) model.unplaced.erase(name);
  if (model.landmarks.empty())
    return std::unexpected(base::Error{file, "has no points" + reasonsIn(model.notes),
                                       "place a point list in 3D Slicer and save it"});
  return model;
}

base::Result<MarkupFixtures> fixturesOfMarkups(const std::string& file) {
  auto read = solids::readMarkups(file);
  if (!read) return std::unexpected(read.error());
  MarkupFixtures result{.additions = {}, .notes = std::move(read->warnings)};
  std::set<std::string> used;
  const std::string file_name = std::filesystem::path(file).filename().string();
  const std::string stem = file_name.substr(0, file_name.find('.'));
  for (const Markup& markup : read->markups) {
    const std::string& name = markup.name.empty() ? stem : markup.name;
    result.notes.push_back(addMarkup(markup, name, used, result.additions));
    if (result.additions.fixtures.size() > rt::kMaxFixtures)
      return std::unexpected(
          base::Error{file,
                      fmt::format("more than {} markups would become fixtures, and a box has "
                                  "room for no more",
                                  rt::kMaxFixtures),
                      "save those that are needed in a file of their own"});
  }
  if (result.additions.fixtures.empty())
    return std::unexpected(base::Error{
        file, "has no line, curve, plane or box that could become a fixture" + reasonsIn(result.notes),
        "use a file of points with --landmarks"});
  return result;
}

}  // namespace hapticd::tools
