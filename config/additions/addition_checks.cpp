// SPDX-License-Identifier: Apache-2.0
#include "config/additions/addition_checks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "config/additions/addition_fields.h"
#include "config/base/counted.h"
#include "config/base/sha256.h"
#include "config/base/value_text.h"

namespace hapticd::config {
namespace {

// Shorter directions lose digits when they are normalised.
constexpr double kMinDirection = 1e-6;
constexpr double kMinCapsule_m = 0.0001;
// The surface is kept ready only so far from the HIP.
constexpr double kFarthestStandoff_m = 0.05;
constexpr std::size_t kMaxPathLength = 4095;

std::string withUnit(double number, std::string_view unit) {
  return unit.empty() ? base::numberText(number) : fmt::format("{} {}", base::numberText(number), unit);
}

std::string vectorText(const rt::Vec3& vector) {
  return fmt::format("[{}, {}, {}]", base::numberText(vector.x), base::numberText(vector.y),
                     base::numberText(vector.z));
}

/// Checks the fields of one fixture or region.
template <typename Owner>
class FieldChecks {
 public:
  using Field = AdditionField<Owner>;

  FieldChecks(const Owner& owner, const FieldNames& skipped) : owner_(owner), skipped_(skipped) {}

  void run() {
    const Owner defaults;
    for (const Field& field : fieldsOf(owner_)) {
      if (skipped_.contains(field.name)) continue;
      if (field.used(owner_)) {
        std::visit([&](const auto& member) { checkMember(field, member); }, field.member);
      } else if (!isSameIn(field, owner_, defaults)) {
        report(field.name, fmt::format("is not a member of a {} of {}", nounOf(owner_), variantOf(owner_)),
               "remove it");
      }
    }
  }

  /// Whether a rule between fields can be checked.
  bool isGood(std::initializer_list<std::string_view> fields) const {
    return std::ranges::none_of(fields, [this](std::string_view field) {
      return skipped_.contains(field) ||
             std::ranges::find(errors_, field, &AdditionError::field) != errors_.end();
    });
  }
  void report(std::string_view field, std::string what, std::string remedy) {
    errors_.push_back(additionError(nounOf(owner_), owner_.name, field, std::move(what), std::move(remedy)));
  }
  std::vector<AdditionError> takeErrors() { return std::move(errors_); }

 private:
  void refuse(const Field& field, const std::string& value, std::string_view why) {
    report(field.name, fmt::format("{} {}", value, why),
           fmt::format("set {} to {}", field.name, rangeOf(field)));
  }

  void checkMember(const Field& field, std::string Owner::*member) {
    if (field.name == "tracks" && (owner_.*member).empty()) return;
    const bool is_hash = field.name == "solid";
    if (is_hash ? base::isSha256(owner_.*member) : isAdditionName(owner_.*member)) return;
    refuse(field, base::inQuotes(owner_.*member),
           is_hash ? "is not the SHA-256 of a file" : "is not a valid name");
  }
  void checkMember(const Field&, bool Owner::*) {}
  void checkMember(const Field& field, int Owner::*member) { checkNumber(field, owner_.*member); }
  void checkMember(const Field& field, double Owner::*member) { checkNumber(field, owner_.*member); }
  void checkMember(const Field& field, std::vector<rt::Vec3> Owner::*member) {
    const std::vector<rt::Vec3>& points = owner_.*member;
    if (points.size() < 2 || points.size() > rt::kMaxPathPoints) {
      return report(field.name, "has " + base::counted(points.size(), "point(s)"),
                    fmt::format("give 2 to {} points", rt::kMaxPathPoints));
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!checkComponents(field, points[i], fmt::format("point {}, {},", i + 1, vectorText(points[i]))))
        return;
    }
  }
  void checkMember(const Field& field, const WordMember<Owner>& member) {
    if (member.get(owner_) >= member.words.size()) refuse(field, "the value", "is not an allowed choice");
  }
  void checkMember(const Field&, const QuaternionMember<Owner>&) {}  // the vector of angles is checked
  void checkMember(const Field& field, const VectorMember<Owner>& member) {
    const rt::Vec3& vector = owner_.*member.member;
    if (!checkComponents(field, vector, vectorText(vector))) return;
    if (member.use == VectorUse::direction && norm(vector) < kMinDirection) {
      refuse(field, vectorText(vector), "is not a direction");
    }
  }

  void checkNumber(const Field& field, double number) {
    if (!std::isfinite(number)) return refuse(field, base::numberText(number), "is not a finite number");
    if (number >= field.minimum && number <= field.maximum) return;
    refuse(field, withUnit(number, field.unit), "is out of range");
  }
  bool checkComponents(const Field& field, const rt::Vec3& vector, const std::string& shown) {
    const auto good = [&field](double number) { return number >= field.minimum && number <= field.maximum; };
    if (!isFinite(vector)) {
      refuse(field, shown, "contains a number that is not finite");
    } else if (!good(vector.x) || !good(vector.y) || !good(vector.z)) {
      refuse(field, shown, "is out of range");
    } else {
      return true;
    }
    return false;
  }

  const Owner& owner_;
  const FieldNames& skipped_;
  std::vector<AdditionError> errors_;
};

template <typename Owner>
void checkCapsule(const Owner& owner, FieldChecks<Owner>& checks) {
  if (!checks.isGood({"position_m", "end_m"})) return;
  if (norm(owner.end_m - owner.position_m) >= kMinCapsule_m) return;
  checks.report("end_m", fmt::format("{} is also position_m", vectorText(owner.end_m)),
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

void checkClearance(const FixtureSettings& fixture, FieldChecks<FixtureSettings>& checks) {
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
void checkMargins(const FixtureSettings& fixture, FieldChecks<FixtureSettings>& checks) {
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
void checkZone(const FixtureSettings& fixture, FieldChecks<FixtureSettings>& checks) {
  if (!checks.isGood({"side", "effect", "kind"}) || fixture.effect != rt::FixtureEffect::slow) return;
  if (fixture.side != rt::FixtureSide::both) return;
  checks.report("side", "is both, and a region that slows the HIP can be entered and left freely",
                "set side to out, to slow the HIP inside the shape, or to in, to slow it outside");
}

template <typename Owner>
std::vector<ItemError> duplicatesIn(std::span<const Owner> owners) {
  std::vector<ItemError> found;
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < owners.size(); ++i) {
    if (names.insert(owners[i].name).second || owners[i].name.empty()) continue;
    found.push_back({i, additionError(nounOf(owners[i]), owners[i].name, "name",
                                      fmt::format("an earlier {} has the same name", nounOf(owners[i])),
                                      "give each its own name")});
  }
  return found;
}

template <typename Owner>
std::optional<AdditionError> surplus(std::span<const Owner> owners, std::size_t count, std::size_t most) {
  if (count <= most) return std::nullopt;
  const std::string_view noun = nounOf(Owner{});
  const std::string name = owners.size() > most ? owners[most].name : "";
  return additionError(noun, name, "",
                       fmt::format("is one of {} {}s, and {} are possible", count, noun, most),
                       fmt::format("remove {}", count - most));
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

std::vector<AdditionError> checkAlone(const FixtureSettings& fixture, const FieldNames& skipped) {
  FieldChecks<FixtureSettings> checks(fixture, skipped);
  checks.run();
  if (skipped.contains("kind")) return checks.takeErrors();
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
  return checks.takeErrors();
}

std::vector<AdditionError> checkAlone(const RegionSettings& region, const FieldNames& skipped) {
  FieldChecks<RegionSettings> checks(region, skipped);
  checks.run();
  const bool capsule = region.place == rt::TissuePlace::shape && region.shape == rt::ShapeKind::capsule;
  if (capsule && checks.isGood({"place", "shape"})) checkCapsule(region, checks);
  return checks.takeErrors();
}

std::vector<AdditionError> checkAlone(const FrameSettings& frame, const FieldNames& skipped) {
  FieldChecks<FrameSettings> checks(frame, skipped);
  checks.run();
  if (isResting(frame.name))
    checks.report("name", fmt::format("{} is the name of a frame that rests", frame.name),
                  "give it another one");
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

std::vector<ItemError> duplicateNames(std::span<const FrameSettings> frames) {
  return duplicatesIn(frames);
}
std::vector<ItemError> duplicateNames(std::span<const FixtureSettings> fixtures) {
  return duplicatesIn(fixtures);
}
std::vector<ItemError> duplicateNames(std::span<const RegionSettings> regions) {
  return duplicatesIn(regions);
}

std::vector<ItemError> unlikeTransitions(std::span<const RegionSettings> regions) {
  std::vector<ItemError> found;
  const RegionSettings* first = nullptr;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const RegionSettings& region = regions[i];
    if (region.place != rt::TissuePlace::label) continue;
    if (first == nullptr) first = &region;
    if (region.transition_m == first->transition_m) continue;
    const std::string width = base::numberText(first->transition_m);
    found.push_back(
        {i, additionError(
                "region", region.name, "transition_m",
                fmt::format("{} m differs from the {} m of region {}, and all regions of place label "
                            "share one width",
                            base::numberText(region.transition_m), width, base::printable(first->name)),
                fmt::format("set transition_m to {} m, or to another width in all of these regions "
                            "at once",
                            width))});
  }
  return found;
}

std::optional<AdditionError> tooMany(std::span<const FixtureSettings> fixtures, std::size_t count) {
  return surplus(fixtures, count, rt::kMaxFixtures);
}
std::optional<AdditionError> tooMany(std::span<const FrameSettings> frames, std::size_t count) {
  return surplus(frames, count, rt::kMaxFrames);
}
std::optional<AdditionError> tooMany(std::span<const RegionSettings> regions, std::size_t count) {
  return surplus(regions, count, rt::kMaxTissueRegions);
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
  const auto checkList = [&errors](const auto& list) {
    for (const auto& owner : list) std::ranges::move(checkAlone(owner), std::back_inserter(errors));
    using Owner = typename std::decay_t<decltype(list)>::value_type;
    const std::span<const Owner> all(list);
    for (ItemError& duplicate : duplicateNames(all)) errors.push_back(std::move(duplicate.error));
    for (ItemError& unlike : unlikeTransitions(all)) errors.push_back(std::move(unlike.error));
    if (auto surplus = tooMany(all, all.size())) errors.push_back(std::move(*surplus));
  };
  checkList(additions.frames);
  checkList(additions.fixtures);
  checkList(additions.regions);
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

}  // namespace hapticd::config
