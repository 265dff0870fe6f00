// SPDX-License-Identifier: Apache-2.0
#include "config/additions/addition_checks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "config/base/counted.h"
#include "config/base/sha256.h"
#include "config/base/value_text.h"
#include "rt/fixtures/fixture.h"

namespace hapticd::config {
namespace {

// Shorter directions lose digits when they are normalised.
constexpr double kMinDirection = 1e-6;
constexpr double kMinCapsule_m = 0.0001;
// The surface is kept ready only so far from the HIP.
constexpr double kFarthestStandoff_m = 0.05;
constexpr std::size_t kMaxPathLength = 4095;

void checkCapsule(const auto& item, AdditionChecks& checks) {
  if (!checks.isGood({"position_m", "end_m"})) return;
  if (norm(item.end_m - item.position_m) >= kMinCapsule_m) return;
  checks.report("end_m", fmt::format("{} is also position_m", toText(item.end_m)),
                "move it away from position_m, or use a sphere");
}

/// Returns the distance of the innermost place of a shape from its boundary; 0: unbounded.
double inside_m(const FixtureSettings& fixture) {
  switch (fixture.kind) {
    case rt::FixtureKind::box:
      return std::min({fixture.size_m.x, fixture.size_m.y, fixture.size_m.z}) / 2;
    case rt::FixtureKind::sphere:
    case rt::FixtureKind::capsule:
      return fixture.radius_m;
    default:
      return 0;
  }
}

void checkClearance(const FixtureSettings& fixture, AdditionChecks& checks) {
  if (!checks.isGood({"clearance_m", "soft_m", "size_m", "radius_m", "side", "kind", "effect"})) return;
  if (fixture.kind == rt::FixtureKind::standoff && !(fixture.clearance_m > 0)) {
    checks.report("clearance_m", "is 0 m, and a standoff keeps the HIP that far from the surface",
                  "set clearance_m above 0, at most 0.05 m");
  }
  if (fixture.kind == rt::FixtureKind::standoff && beginning_m(fixture) > kFarthestStandoff_m) {
    checks.report(
        "soft_m",
        fmt::format("{} m and the clearance of {} m reach {} m from the surface, and a standoff may "
                    "reach {} m",
                    base::numberText(fixture.soft_m), base::numberText(fixture.clearance_m),
                    base::numberText(beginning_m(fixture)), base::numberText(kFarthestStandoff_m)),
        "lower soft_m or clearance_m");
  }
  const double room_m = inside_m(fixture);
  if (fixture.side == rt::FixtureSide::out || room_m <= 0 || beginning_m(fixture) < room_m) return;
  if (fixture.soft_m > 0 && fixture.clearance_m < room_m) {
    return checks.report(
        "soft_m",
        fmt::format("{} m leaves no room inside, where the boundary is at most {} m away",
                    base::numberText(fixture.soft_m), base::numberText(room_m - fixture.clearance_m)),
        fmt::format("set soft_m below {} m, make the {} larger, or set side to out",
                    base::numberText(room_m - fixture.clearance_m), rt::wordOf(fixture.kind)));
  }
  checks.report("clearance_m",
                fmt::format("{} m leaves no room inside, where the boundary is at most {} m away",
                            base::numberText(fixture.clearance_m), base::numberText(room_m)),
                fmt::format("set clearance_m below {} m, make the {} larger, or set side to out",
                            base::numberText(room_m), rt::wordOf(fixture.kind)));
}

/// The distances before the boundary, which must be in this order: warn, soften, stop.
void checkMargins(const FixtureSettings& fixture, AdditionChecks& checks) {
  if (rt::isGuidance(fixture.kind) || !(fixture.soft_m > 0)) return;
  if (checks.isGood({"warning_m", "soft_m"}) && fixture.warning_m > 0 &&
      fixture.warning_m <= fixture.soft_m) {
    checks.report("warning_m",
                  fmt::format("{} m is not before the soft layer, which begins {} m before the boundary",
                              base::numberText(fixture.warning_m), base::numberText(fixture.soft_m)),
                  fmt::format("set warning_m above {} m, or to 0", base::numberText(fixture.soft_m)));
  }
  if (!checks.isGood({"soft_m", "soft_stiffness_n_per_m", "stiffness_n_per_m", "max_force_n"})) return;
  if (fixture.soft_stiffness_n_per_m > fixture.stiffness_n_per_m) {
    return checks.report("soft_stiffness_n_per_m",
                         fmt::format("{} N/m is stiffer than the region, which has {} N/m",
                                     base::numberText(fixture.soft_stiffness_n_per_m),
                                     base::numberText(fixture.stiffness_n_per_m)),
                         fmt::format("set soft_stiffness_n_per_m to at most {} N/m",
                                     base::numberText(fixture.stiffness_n_per_m)));
  }
  if (fixture.soft_stiffness_n_per_m * fixture.soft_m < fixture.max_force_n) return;
  checks.report(
      "soft_m",
      fmt::format("the soft layer alone reaches max_force_n: {} m at {} N/m are {} N, and the "
                  "boundary behind it could not be felt",
                  base::numberText(fixture.soft_m), base::numberText(fixture.soft_stiffness_n_per_m),
                  base::numberText(fixture.soft_stiffness_n_per_m * fixture.soft_m)),
      fmt::format("set soft_m below {:.4g} m, or soft_stiffness_n_per_m lower, or max_force_n higher",
                  fixture.max_force_n / fixture.soft_stiffness_n_per_m));
}

/// A region that slows the HIP is entered freely, so it has no side on which the HIP stays.
void checkZone(const FixtureSettings& fixture, AdditionChecks& checks) {
  if (!checks.isGood({"side", "effect", "kind"}) || fixture.effect != rt::FixtureEffect::slow) return;
  if (fixture.side != rt::FixtureSide::both) return;
  checks.report("side", "is both, and a region that slows the HIP can be entered and left freely",
                "set side to out, to slow the HIP inside the shape, or to in, to slow it outside");
}

}  // namespace

AdditionError additionError(std::string_view noun, std::string_view name, std::string_view field,
                            std::string what, std::string remedy) {
  std::string where(noun);
  // A name that is itself at fault would repeat an arbitrary text.
  if (isAdditionName(name)) where += fmt::format(" {}", name);
  if (!field.empty()) where += fmt::format(": {}", field);
  return {std::string(name), std::string(field), {std::move(where), std::move(what), std::move(remedy)}};
}

void AdditionChecks::checkFields() {
  const Addition defaults(item_.type(), item_.type().defaults);
  for (const AdditionField& field : item_.fields()) {
    if (skipped_.contains(field.name)) continue;
    if (item_.has(field)) {
      checkField(field);
    } else if (!isSameIn(field, item_, defaults)) {
      report(field.name, fmt::format("is not a member of a {} of {}", item_.type().noun, item_.variant()),
             "remove it");
    }
  }
}

bool AdditionChecks::isGood(std::initializer_list<std::string_view> fields) const {
  return std::ranges::none_of(fields, [this](std::string_view field) {
    return skipped_.contains(field) ||
           std::ranges::find(errors_, field, &AdditionError::field) != errors_.end();
  });
}

void AdditionChecks::report(std::string_view field, std::string what, std::string remedy) {
  errors_.push_back(
      additionError(item_.type().noun, item_.name(), field, std::move(what), std::move(remedy)));
}

void AdditionChecks::refuse(const AdditionField& field, std::string what) {
  report(field.name, std::move(what), fmt::format("set {} to {}", field.name, rangeOf(field)));
}

void AdditionChecks::checkField(const AdditionField& field) {
  const Value value = item_.get(field);
  if (field.kind == Kind::quaternion) return;  // the vector of angles is checked
  if (const auto* const text = std::get_if<std::string>(&value)) return checkText(field, *text);
  if (const auto* const points = std::get_if<std::vector<rt::Vec3>>(&value))
    return checkPoints(field, *points);
  if (const auto* const vector = std::get_if<rt::Vec3>(&value)) {
    if (checkVector(field, *vector, toText(value)) && field.kind == Kind::direction &&
        norm(*vector) < kMinDirection)
      refuse(field, toText(value) + " is not a direction");
    return;
  }
  const auto* const whole = std::get_if<std::int64_t>(&value);
  const auto* const number = std::get_if<double>(&value);
  if (whole == nullptr && number == nullptr) return;
  const double held = number != nullptr ? *number : static_cast<double>(*whole);
  if (std::string problem = field.problemOf(held, toText(value)); !problem.empty())
    refuse(field, std::move(problem));
}

void AdditionChecks::checkText(const AdditionField& field, const std::string& text) {
  if (field.kind == Kind::choice) {
    if (std::ranges::find(field.choices, text) == field.choices.end())
      refuse(field, "the value is not an allowed choice");
  } else if (field.kind == Kind::hash) {
    if (!base::isSha256(text)) refuse(field, base::inQuotes(text) + " is not the SHA-256 of a file");
  } else if (!isAdditionName(text)) {
    const bool may_be_empty = field.kind == Kind::name && field.required == 0;
    if (!text.empty() || !may_be_empty) refuse(field, base::inQuotes(text) + " is not a valid name");
  }
}

bool AdditionChecks::checkVector(const AdditionField& field, const rt::Vec3& vector,
                                 const std::string& shown) {
  const auto good = [&field](double number) { return number >= field.minimum && number <= field.maximum; };
  if (!isFinite(vector)) {
    refuse(field, shown + " contains a number that is not finite");
  } else if (!good(vector.x) || !good(vector.y) || !good(vector.z)) {
    refuse(field, shown + " is out of range");
  } else {
    return true;
  }
  return false;
}

void AdditionChecks::checkPoints(const AdditionField& field, const std::vector<rt::Vec3>& points) {
  if (points.size() < 2 || points.size() > rt::kMaxPathPoints) {
    return report(field.name, "has " + base::counted(points.size(), "point(s)"),
                  fmt::format("give 2 to {} points", rt::kMaxPathPoints));
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!checkVector(field, points[i], fmt::format("point {}, {},", i + 1, toText(points[i])))) return;
  }
}

void checkRules(const FixtureSettings& fixture, AdditionChecks& checks) {
  checkClearance(fixture, checks);
  checkMargins(fixture, checks);
  checkZone(fixture, checks);
  if (fixture.kind == rt::FixtureKind::capsule) checkCapsule(fixture, checks);
  if (isGuidance(fixture.kind) && !isResting(fixture.frame) && checks.isGood({"frame"})) {
    checks.report(
        "frame",
        fmt::format("{} moves, and guidance along a {} cannot move", fixture.frame, rt::wordOf(fixture.kind)),
        "set frame to world or camera");
  }
  if (fixture.kind == rt::FixtureKind::path && checks.isGood({"points_m"})) {
    if (auto problem = pathProblem(fixture.points_m, fixture.allow_crossing)) {
      checks.report("points_m", std::move(problem->what), std::move(problem->remedy));
    }
  }
}

void checkRules(const RegionSettings& region, AdditionChecks& checks) {
  const bool capsule = region.place == rt::TissuePlace::shape && region.shape == rt::ShapeKind::capsule;
  if (capsule && checks.isGood({"place", "shape"})) checkCapsule(region, checks);
}

void checkRules(const FrameSettings& frame, AdditionChecks& checks) {
  if (isResting(frame.name))
    checks.report("name", fmt::format("{} is the name of a frame that rests", frame.name),
                  "give it another one");
}

std::vector<AdditionError> checkAlone(const Addition& item, const FieldNames& skipped) {
  AdditionChecks checks(item, skipped);
  checks.checkFields();
  if (!skipped.contains("kind")) item.check(checks);
  return checks.takeErrors();
}

std::vector<AdditionError> unknownFrames(const SceneAdditions& additions) {
  std::vector<AdditionError> errors;
  std::vector<std::string_view> names{"world", "camera"};
  for (const FrameSettings& frame : additions.frames) names.push_back(frame.name);
  for (const FixtureSettings& fixture : additions.fixtures) {
    if (std::ranges::find(names, fixture.frame) != names.end()) continue;
    errors.push_back(additionError("fixture", fixture.name, "frame",
                                   fmt::format("there is no frame {}", base::inQuotes(fixture.frame)),
                                   fmt::format("set frame to one of: {}, or add it to the list frames of the "
                                               "configuration",
                                               fmt::join(names, ", "))));
  }
  for (const FrameSettings& frame : additions.frames) {
    if (frame.tracks.empty()) continue;
    const auto tracked = std::ranges::find(additions.fixtures, frame.tracks, &FixtureSettings::name);
    const bool good = tracked != additions.fixtures.end() && tracked->kind == rt::FixtureKind::solid &&
                      tracked->frame == frame.name;
    // Clients add the fixture, and may remove it again; until then the frame has no place.
    if (good || tracked == additions.fixtures.end()) continue;
    errors.push_back(additionError(
        "frame", frame.name, "tracks",
        fmt::format("the fixture {} is no solid in the frame {}", base::inQuotes(frame.tracks), frame.name),
        fmt::format("set its kind to solid and its frame to {}", frame.name)));
  }
  return errors;
}

std::vector<ItemError> duplicateNames(const AdditionSpan& items) {
  std::vector<ItemError> found;
  std::set<std::string> names;
  const std::string_view noun = items.type().noun;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const std::string name = items[i].name();
    if (names.insert(name).second || name.empty()) continue;
    found.push_back(
        {i, additionError(noun, name, "name", fmt::format("an earlier {} has the same name", noun),
                          "give each its own name")});
  }
  return found;
}

std::vector<ItemError> unlikeTransitions(const AdditionSpan& items) {
  std::vector<ItemError> found;
  const RegionSettings* first = nullptr;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const auto* const region = items[i].as<RegionSettings>();
    if (region == nullptr || region->place != rt::TissuePlace::label) continue;
    if (first == nullptr) first = region;
    if (region->transition_m == first->transition_m) continue;
    const std::string width = base::numberText(first->transition_m);
    found.push_back(
        {i, additionError(
                "region", region->name, "transition_m",
                fmt::format("{} m differs from the {} m of region {}, and all regions of place label "
                            "share one width",
                            base::numberText(region->transition_m), width, base::printable(first->name)),
                fmt::format("set transition_m to {} m, or to another width in all of these regions "
                            "at once",
                            width))});
  }
  return found;
}

std::optional<AdditionError> tooMany(const AdditionSpan& items, std::size_t count) {
  const AdditionType& type = items.type();
  if (count <= type.most) return std::nullopt;
  return additionError(type.noun, items.size() > type.most ? items[type.most].name() : "", "",
                       fmt::format("is one of {} {}, and {} are possible", count, type.list, type.most),
                       fmt::format("remove {}", count - type.most));
}

std::optional<AdditionError> toolProblem(const SceneAdditions& additions, double tool_radius_m) {
  if (!(tool_radius_m > 0)) return std::nullopt;
  for (const FixtureSettings& fixture : additions.fixtures) {
    const bool standoff = fixture.kind == rt::FixtureKind::standoff;
    const double room_m = standoff ? kFarthestStandoff_m : inside_m(fixture);
    const bool limited = standoff || (fixture.side != rt::FixtureSide::out && room_m > 0);
    if (!limited || beginning_m(fixture) + tool_radius_m < room_m) continue;
    return additionError(
        "fixture", fixture.name, "clearance_m",
        fmt::format("with the tool's radius of {} m the tip is kept {} m from the boundary, and "
                    "less than {} m is possible",
                    base::numberText(tool_radius_m), base::numberText(beginning_m(fixture) + tool_radius_m),
                    base::numberText(room_m)),
        "lower tool.radius_m, clearance_m or soft_m");
  }
  return std::nullopt;
}

std::optional<AdditionError> labelImageProblem(const SceneAdditions& additions) {
  if (!additions.label_image.empty()) return std::nullopt;
  const auto labelled = std::ranges::find(additions.regions, rt::TissuePlace::label, &RegionSettings::place);
  if (labelled == additions.regions.end()) return std::nullopt;
  return additionError("region", labelled->name, "label", "there is no label image that it could refer to",
                       "set label_image to the path of the image, or set place to shape");
}

std::vector<AdditionError> checkTogether(const SceneAdditions& additions) {
  std::vector<AdditionError> errors;
  const auto checkList = [&errors](const AdditionSpan& items) {
    for (std::size_t i = 0; i < items.size(); ++i)
      std::ranges::move(checkAlone(items[i]), std::back_inserter(errors));
    for (ItemError& duplicate : duplicateNames(items)) errors.push_back(std::move(duplicate.error));
    for (ItemError& unlike : unlikeTransitions(items)) errors.push_back(std::move(unlike.error));
    if (auto surplus = tooMany(items, items.size())) errors.push_back(std::move(*surplus));
  };
  forEachList(checkList, additions);
  if (additions.label_image.size() > kMaxPathLength || base::firstInvalidUtf8(additions.label_image) ||
      base::firstUnprintable(additions.label_image)) {
    errors.push_back(
        {"",
         "label_image",
         {"label_image", fmt::format("{} is not a path", base::inQuotes(additions.label_image)),
          fmt::format("give the path of a PGM file, at most {} bytes of printable text", kMaxPathLength)}});
  }
  if (auto missing = labelImageProblem(additions)) errors.push_back(std::move(*missing));
  return errors;
}

namespace {

using rt::Vec3;

constexpr double kSharpestTurn_deg = 175;
constexpr double kCrossingDistance_m = 0.001;

double angleBetween_deg(const Vec3& a, const Vec3& b) {
  return std::atan2(norm(cross(a, b)), dot(a, b)) * 180 / std::numbers::pi;
}

/// Returns the distance of two segments of at least kMinPointDistance_m (Ericson, Real-Time Collision
/// Detection, section 5.1.9).
double segmentDistance_m(const Vec3& p1, const Vec3& q1, const Vec3& p2, const Vec3& q2) {
  const Vec3 d1 = q1 - p1;
  const Vec3 d2 = q2 - p2;
  const Vec3 r = p1 - p2;
  const double a = dot(d1, d1);
  const double e = dot(d2, d2);
  const double f = dot(d2, r);
  const double c = dot(d1, r);
  const double b = dot(d1, d2);
  const double denominator = a * e - b * b;
  double s = denominator > 0 ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0;
  double t = (b * s + f) / e;
  if (t < 0 || t > 1) {
    t = std::clamp(t, 0.0, 1.0);
    s = std::clamp((b * t - c) / a, 0.0, 1.0);
  }
  return norm((p1 + s * d1) - (p2 + t * d2));
}

/// `closed`: the last point is the first one.
std::optional<PathProblem> crossing(std::span<const Vec3> points_m, bool closed) {
  const std::size_t segments = points_m.size() - 1;
  std::vector<double> along_m{0};  // length of the path up to each point
  for (std::size_t i = 0; i < segments; ++i)
    along_m.push_back(along_m.back() + norm(points_m[i + 1] - points_m[i]));
  for (std::size_t i = 0; i + 2 < segments; ++i) {
    for (std::size_t j = i + 2; j < segments; ++j) {
      const double forwards_m = along_m[j] - along_m[i + 1];
      const double around_m = along_m[segments] - along_m[j + 1] + along_m[i];
      const double gap_m = closed ? std::min(forwards_m, around_m) : forwards_m;
      // Near each other along the path, segments are near each other in space too without any crossing.
      const double least_m = std::min(kCrossingDistance_m, gap_m / 2);
      const double distance_m = segmentDistance_m(points_m[i], points_m[i + 1], points_m[j], points_m[j + 1]);
      if (distance_m >= least_m) continue;
      return PathProblem{
          fmt::format("the path crosses itself: the segments from point {} to {} and from {} to {} are "
                      "{:.2g} m apart",
                      i + 1, i + 2, j + 1, j + 2, distance_m),
          i == 0 && j + 1 == segments && !closed
              ? "to make it a closed path, end it in its first point; otherwise move the points apart by "
                "more "
                "than 0.001 m, or set allow_crossing to true"
              : "move the points apart by more than 0.001 m, or set allow_crossing to true"};
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<PathProblem> pathProblem(std::span<const Vec3> given_m, bool allow_crossing) {
  const bool closed = rt::isClosedPath(given_m);
  std::vector<Vec3> points_m(given_m.begin(), given_m.end());
  if (closed) points_m.back() = points_m.front();
  for (std::size_t i = 0; i + 1 < points_m.size(); ++i) {
    const double distance_m = norm(points_m[i + 1] - points_m[i]);
    if (distance_m >= rt::kMinPointDistance_m) continue;
    return PathProblem{fmt::format("points {} and {} are {:.2g} m apart", i + 1, i + 2, distance_m),
                       fmt::format("delete one of the two, or move them at least {} m apart",
                                   base::numberText(rt::kMinPointDistance_m))};
  }
  for (std::size_t i = 1; i + (closed ? 0 : 1) < points_m.size(); ++i) {
    const Vec3 onward = i + 1 < points_m.size() ? points_m[i + 1] - points_m[i] : points_m[1] - points_m[0];
    const double turn_deg = angleBetween_deg(points_m[i] - points_m[i - 1], onward);
    if (turn_deg <= kSharpestTurn_deg) continue;
    return PathProblem{fmt::format("the path turns by {:.1f} degrees at point {}", turn_deg, i + 1),
                       fmt::format("add a point beside it, so that no turn exceeds {} degrees",
                                   base::numberText(kSharpestTurn_deg))};
  }
  return allow_crossing ? std::nullopt : crossing(points_m, closed);
}

}  // namespace hapticd::config
