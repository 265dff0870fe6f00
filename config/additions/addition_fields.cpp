// SPDX-License-Identifier: Apache-2.0
#include "config/additions/addition_fields.h"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "config/additions/addition_checks.h"
#include "config/settings/row_of_member.h"
#include "config/settings/yaml_text.h"

namespace hapticd::config {

template <>
inline constexpr std::array<std::string_view, 2> kWords<rt::TissuePlace>{"shape", "label"};

namespace {

using rt::FixtureKind;

constexpr std::size_t kMaxNameLength = 32;

// Metres. The smallest size that the scene can show at all is far above it.
constexpr double kMinSize_m = 0.0001;
constexpr double kFarthest_m = 10;

// A direction may have any length; this keeps its square within the numbers that a double can hold.
constexpr double kMaxDirection = 1e6;

// --- traits

constexpr Traits kAll = ~Traits{0};
constexpr Traits kNever = 0;

constexpr Traits bit(auto number) {
  return Traits{1} << static_cast<unsigned>(number);
}

template <FixtureKind... kinds>
constexpr Traits kOf = (bit(kinds) | ...);
constexpr Traits kKinds = bit(rt::kWords<FixtureKind>.size()) - 1;
constexpr Traits kGuidance = kOf<FixtureKind::path, FixtureKind::point>;
constexpr Traits kForbidden = kKinds & ~kGuidance;
constexpr Traits kPlaced = kKinds & ~kOf<FixtureKind::standoff, FixtureKind::path>;
// Behind all kinds.
constexpr Traits kHolds = bit(16), kSlows = bit(17), kSprings = bit(18);

Traits traitsOf(const FixtureSettings& fixture) {
  const Traits kind = bit(fixture.kind);
  if ((kind & kGuidance) != 0) return kind | kSprings;
  return kind | (fixture.effect == rt::FixtureEffect::slow ? kSlows : kHolds | kSprings);
}

constexpr Traits kInSphere = bit(rt::ShapeKind::sphere), kInBox = bit(rt::ShapeKind::box),
                 kInCapsule = bit(rt::ShapeKind::capsule);
constexpr Traits kInShape = bit(rt::kWords<rt::ShapeKind>.size()) - 1;
constexpr Traits kAtLabel = bit(8);
// Behind all shapes.
constexpr unsigned kFirstModel = 16;
constexpr Traits kLinear = bit(rt::ContactModel::linear) << kFirstModel,
                 kHuntCrossley = bit(rt::ContactModel::hunt_crossley) << kFirstModel,
                 kLayered = bit(rt::ContactModel::layered) << kFirstModel;

Traits traitsOf(const RegionSettings& region) {
  return (region.place == rt::TissuePlace::label ? kAtLabel : bit(region.shape)) | bit(region.model)
                                                                                       << kFirstModel;
}

Traits traitsOf(const FrameSettings&) {
  return kAll;
}

std::string variantOf(const FixtureSettings& fixture) {
  const bool slows = (traitsOf(fixture) & kSlows) != 0;
  return fmt::format("kind {}{}", rt::wordOf(fixture.kind), slows ? " and effect slow" : "");
}

std::string variantOf(const RegionSettings& region) {
  const bool labelled = region.place == rt::TissuePlace::label;
  return fmt::format("{}{} and model {}", labelled ? "place label" : "shape ",
                     labelled ? "" : rt::wordOf(region.shape), rt::wordOf(region.model));
}

std::string variantOf(const FrameSettings&) {
  return "any kind";
}

// --- rows

template <auto kMember, typename Item, typename Member>
constexpr AdditionField field(Member Item::*, std::string_view name, std::string_view unit, Range range,
                              Traits used, Traits required, std::string_view help,
                              std::optional<Looser> looser = std::nullopt) {
  return {rowOf<Member>(name, unit, range, help),
          used,
          required,
          [](const void* item) { return valueOf(static_cast<const Item*>(item)->*kMember); },
          [](void* item, const Value& value) { assign(static_cast<Item*>(item)->*kMember, value); },
          looser};
}

constexpr AdditionField as(Kind kind, AdditionField field) {
  field.kind = kind;
  return field;
}
/// Makes the row of the angles one of another way to give them.
constexpr AdditionField quaternion(AdditionField angles) {
  angles.name = "orientation_xyzw";
  return as(Kind::quaternion, angles);
}
/// The shapes of regions are those of rt::ShapeKind that are bounded.
constexpr AdditionField bounded(AdditionField shape) {
  shape.choices = std::span(rt::kWords<rt::ShapeKind>).subspan(1, 3);
  return shape;
}

#define OF_MEMBER(path, name, ...) field<path>(path, name, __VA_ARGS__)
#define OF_FIXTURE(member, ...) OF_MEMBER(&FixtureSettings::member, #member, __VA_ARGS__)
#define OF_REGION(member, ...) OF_MEMBER(&RegionSettings::member, #member, __VA_ARGS__)
#define OF_FRAME(member, ...) OF_MEMBER(&FrameSettings::member, #member, __VA_ARGS__)

using enum FixtureKind;
using enum Looser;

// Columns: the member, unit, {minimum, maximum}, the traits with which it is there, those with which it must
// be given, help, and which value protects less.
// clang-format off
constexpr auto kFixtureFields = std::to_array<AdditionField>({
    as(Kind::name, OF_FIXTURE(name, "", {}, kAll, kAll,
        "1 to 32 letters, digits, '_' and '-'; unique")),
    OF_FIXTURE(kind, "", {}, kAll, kAll,
        "what the fixture is"),
    OF_FIXTURE(side, "", {}, kForbidden & ~kOf<standoff>, kNever,
        "side of the boundary on which the HIP is kept; both: the one where it was when the fixture began to act"),
    OF_FIXTURE(effect, "", {}, kForbidden, kNever,
        "hold: a spring holds the HIP off the region; slow: the HIP moves freely in it, against a force that only"
        " opposes its motion"),
    as(Kind::frame, OF_FIXTURE(frame, "", {}, kPlaced | kOf<path>, kNever,
        "frame of the vectors; one of the list frames moves, and the fixture with it")),
    OF_FIXTURE(enabled, "", {}, kAll, kNever,
        "whether it acts", lower),
    OF_FIXTURE(position_m, "m", {-kFarthest_m, kFarthest_m}, kPlaced, kPlaced,
        "plane: a point of it; box, sphere: centre; capsule: first end; cone: tip; solid: origin of its frame; "
        "point: the point"),
    as(Kind::direction, OF_FIXTURE(normal, "", {-kMaxDirection, kMaxDirection}, kOf<plane>, kOf<plane>,
        "towards the free side; any length except zero")),
    as(Kind::direction, OF_FIXTURE(axis, "", {-kMaxDirection, kMaxDirection}, kOf<cone>, kOf<cone>,
        "from the tip into the cone; any length except zero")),
    OF_FIXTURE(end_m, "m", {-kFarthest_m, kFarthest_m}, kOf<capsule>, kOf<capsule>,
        "second end"),
    OF_FIXTURE(size_m, "m", {kMinSize_m, kFarthest_m}, kOf<box>, kOf<box>,
        "lengths of the edges"),
    OF_FIXTURE(rotation_deg, "deg", {-360, 360}, kOf<box, solid>, kNever,
        "roll, pitch and yaw about the fixed axes x, y and z of the frame, in this order"),
    quaternion(OF_FIXTURE(rotation_deg, "", {-1, 1}, kOf<box, solid>, kNever,
        "the rotation as a unit quaternion, instead of rotation_deg")),
    OF_FIXTURE(radius_m, "m", {kMinSize_m, kFarthest_m}, kOf<sphere, capsule>, kOf<sphere, capsule>,
        "radius"),
    OF_FIXTURE(half_angle_deg, "deg", {1, 85}, kOf<cone>, kNever,
        "angle between the axis and the side of the cone"),
    as(Kind::hash, OF_FIXTURE(solid, "", {}, kOf<solid>, kOf<solid>,
        "SHA-256 of the file with its shape, which fixture add --mesh and --labels send")),
    OF_FIXTURE(points_m, "m", {-kFarthest_m, kFarthest_m}, kOf<path>, kOf<path>,
        "2 to 256 points of the path, neighbours at least 0.0005 m apart, no turn over 175 degrees; closed where "
        "the last is the first"),
    OF_FIXTURE(allow_crossing, "", {}, kOf<path>, kNever,
        "whether the path may come within 0.001 m of itself"),
    OF_FIXTURE(bend_radius_m, "m", {0.0005, 0.1}, kOf<path>, kNever,
        "bends are arcs of this radius, or less where there is no room"),
    OF_FIXTURE(clearance_m, "m", {0, 0.05}, kForbidden, kOf<standoff>,
        "the HIP is kept this far from the boundary; of a standoff: from the visible surface, above 0", lower),
    OF_FIXTURE(warning_m, "m", {0, 0.1}, kForbidden, kNever,
        "nearer than this the fixture's stage is warning, and is counted; more than soft_m; 0: no warning", lower),
    OF_FIXTURE(soft_m, "m", {0, 0.05}, kHolds, kNever,
        "thickness of a softer layer before the boundary; 0: none", lower),
    OF_FIXTURE(soft_stiffness_n_per_m, "N/m", {1, 5000}, kHolds, kNever,
        "stiffness of that layer; at most stiffness_n_per_m", lower),
    OF_FIXTURE(breach_m, "m", {0.0001, 0.05}, kHolds, kNever,
        "deeper than this behind the boundary is a breach", higher),
    OF_FIXTURE(viscosity_n_s_per_m, "N s/m", {0.1, 50}, kSlows, kNever,
        "force against the motion for each m/s above the speed limit", lower),
    OF_FIXTURE(speed_limit_m_per_s, "m/s", {0, 1}, kSlows, kNever,
        "no force up to this speed; 0: at any speed, as in a viscous medium", higher),
    OF_FIXTURE(ramp_m, "m", {0.0005, 0.05}, kSlows, kNever,
        "the force rises to its full size over this depth behind the boundary", higher),
    OF_FIXTURE(stiffness_n_per_m, "N/m", {1, 5000}, kSprings, kNever,
        "stiffness of the spring that holds the HIP off the region or pulls it to the path or point", lower),
    OF_FIXTURE(damping_n_s_per_m, "N s/m", {0, 50}, kSprings, kNever,
        "forbidden region: while approaching; guidance: across the path", never),
    OF_FIXTURE(deadband_m, "m", {0, 0.1}, kGuidance, kNever,
        "no force up to this distance from the path or point"),
    OF_FIXTURE(max_force_n, "N", {0.05, 40}, kAll, kNever,
        "largest force; it limits the force, never where the proxy is", lower),
    OF_FIXTURE(fade_in_s, "s", {0, 10}, kAll, kNever,
        "time over which the fixture begins to act", higher),
    OF_FIXTURE(escape_force_n, "N", {0, 40}, kGuidance, kNever,
        "above this force the guidance gives way; 0: never"),
    OF_FIXTURE(on_camera_loss, "", {}, kAll, kNever,
        "whether it goes on acting while the camera is lost; auto: fade for a standoff, keep for others"),
});

constexpr auto kRegionFields = std::to_array<AdditionField>({
    as(Kind::name, OF_REGION(name, "", {}, kAll, kAll,
        "1 to 32 letters, digits, '_' and '-'; unique")),
    OF_REGION(place, "", {}, kAll, kNever,
        "where the region is: inside a shape, or where the label image has its label"),
    bounded(OF_REGION(shape, "", {}, kInShape, kInShape,
        "shape of the region")),
    OF_REGION(frame, "", {}, kInShape, kNever,
        "frame of the vectors; a region cannot move with one of the list frames"),
    OF_REGION(position_m, "m", {-kFarthest_m, kFarthest_m}, kInShape, kInShape,
        "sphere, box: centre; capsule: first end"),
    OF_REGION(end_m, "m", {-kFarthest_m, kFarthest_m}, kInCapsule, kInCapsule,
        "second end"),
    OF_REGION(size_m, "m", {kMinSize_m, kFarthest_m}, kInBox, kInBox,
        "lengths of the edges"),
    OF_REGION(rotation_deg, "deg", {-360, 360}, kInBox, kNever,
        "roll, pitch and yaw about the fixed axes x, y and z of the frame, in this order"),
    quaternion(OF_REGION(rotation_deg, "", {-1, 1}, kInBox, kNever,
        "the rotation as a unit quaternion, instead of rotation_deg")),
    OF_REGION(radius_m, "m", {kMinSize_m, kFarthest_m}, kInSphere | kInCapsule, kInSphere | kInCapsule,
        "radius"),
    OF_REGION(label, "", {1, 255}, kAtLabel, kAtLabel,
        "grey value of the region in the label image"),
    OF_REGION(transition_m, "m", {0.002, 0.1}, kAll, kNever,
        "width over which the contact passes to that of the surroundings, half of it inside; the same for all "
        "regions of place label"),
    OF_REGION(model, "", {}, kAll, kNever,
        "how the force depends on the depth of the HIP below the surface"),
    OF_REGION(stiffness_n_per_m, "N/m", {1, 5000}, kAll, kNever,
        "stiffness of the contact; hunt_crossley: the secant stiffness at a depth of 0.005 m"),
    OF_REGION(exponent, "", {1, 2}, kHuntCrossley, kNever,
        "exponent of the depth; 1.5: a sphere on an elastic half-space"),
    OF_REGION(damping_per_speed_s_per_m, "s/m", {0, 5}, kHuntCrossley, kNever,
        "damping in proportion to the elastic force and to the speed of penetration"),
    OF_REGION(lower_stiffness_n_per_m, "N/m", {1, 5000}, kLayered, kNever,
        "stiffness below the layer"),
    OF_REGION(layer_m, "m", {0.0005, 0.05}, kLayered, kNever,
        "thickness of the layer"),
    OF_REGION(damping_n_s_per_m, "N s/m", {0, 50}, kLinear | kLayered, kNever,
        "damping along the surface normal"),
    OF_REGION(friction, "", {0, 2}, kAll, kNever,
        "Coulomb friction coefficient"),
    OF_REGION(cue_force_n, "N", {0, 0.3}, kAll, kNever,
        "amplitude of the palpation cue, a vibration along the surface; 0: none"),
    OF_REGION(cue_hz, "Hz", {1, 250}, kAll, kNever,
        "frequency of the palpation cue"),
});

constexpr auto kFrameFields = std::to_array<AdditionField>({
    as(Kind::name, OF_FRAME(name, "", {}, kAll, kAll,
        "1 to 32 letters, digits, '_' and '-'; unique; neither world nor camera")),
    OF_FRAME(on_loss, "", {}, kAll, kNever,
        "when poses stop coming: hold: its fixtures stay where they are; fade: their force ends; stop: all force "
        "of the box"),
    OF_FRAME(timeout_s, "s", {0.05, 10}, kAll, kNever,
        "the frame is lost when its newest pose is older"),
    OF_FRAME(keepalive, "", {}, kAll, kNever,
        "whether the source repeats poses that have not changed; false: silence means that nothing moves, and is "
        "no loss"),
    OF_FRAME(max_speed_m_per_s, "m/s", {0.01, rt::kFastestFrame_m_per_s}, kAll, kNever,
        "largest speed of the frame's origin; ten times as many radians per second are the largest of its turning"),
    as(Kind::name, OF_FRAME(tracks, "", {}, kAll, kNever,
        "a fixture of kind solid in this frame, which the depth camera follows; empty: poses are fed")),
});
// clang-format on

template <typename Item>
AdditionType typeWith(std::string_view noun, std::string_view list, std::size_t most,
                      std::span<const AdditionField> fields) {
  static const Item kDefaults{};
  return {.noun = noun,
          .list = list,
          .most = most,
          .fields = fields,
          .defaults = &kDefaults,
          .traits = [](const void* item) { return traitsOf(*static_cast<const Item*>(item)); },
          .variant = [](const void* item) { return variantOf(*static_cast<const Item*>(item)); },
          .checkRules = [](const void* item,
                           AdditionChecks& checks) { checkRules(*static_cast<const Item*>(item), checks); }};
}

}  // namespace

const AdditionType& typeOf(const FixtureSettings&) {
  static const AdditionType kType =
      typeWith<FixtureSettings>("fixture", "fixtures", rt::kMaxFixtures, kFixtureFields);
  return kType;
}

const AdditionType& typeOf(const RegionSettings&) {
  static const AdditionType kType =
      typeWith<RegionSettings>("region", "regions", rt::kMaxTissueRegions, kRegionFields);
  return kType;
}

const AdditionType& typeOf(const FrameSettings&) {
  static const AdditionType kType = typeWith<FrameSettings>("frame", "frames", rt::kMaxFrames, kFrameFields);
  return kType;
}

bool isSameIn(const AdditionField& field, const Addition& a, const Addition& b) {
  return field.kind == Kind::quaternion || a.get(field) == b.get(field);
}

bool isAdditionName(std::string_view name) {
  return !name.empty() && name.size() <= kMaxNameLength &&
         name.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-") ==
             std::string_view::npos;
}

std::string rangeOf(const AdditionField& field) {
  return (field.kind == Kind::integer ? "whole number " : "") + field.range();
}

// All values have one form that is valid in YAML and in JSON alike.

std::string lineOf(const Addition& item) {
  std::string members;
  for (const AdditionField& field : item.fields()) {
    if (!item.writes(field)) continue;
    members +=
        fmt::format("{}\"{}\": {}", members.empty() ? "" : ", ", field.name, quotedText(item.get(field)));
  }
  return fmt::format("{{{}}}", members);
}

std::string textOf(const SceneAdditions& additions) {
  std::string text;
  forEachList(
      [&text](const auto& list) {
        const AdditionSpan items(list);
        // Without frames the text is one that older versions read.
        if (items.size() == 0 && items.type().list == "frames") return;
        text += fmt::format("{}:{}\n", items.type().list, items.size() == 0 ? " []" : "");
        for (std::size_t i = 0; i < items.size(); ++i) {
          std::string_view mark = "- ";
          for (const AdditionField& field : items.type().fields) {
            if (!items[i].writes(field)) continue;
            const Value value = items[i].get(field);
            text += fmt::format("  {}{}: {}\n", mark, field.name,
                                field.kind == Kind::choice ? toText(value) : quotedText(value));
            mark = "  ";
          }
        }
      },
      additions);
  return text + fmt::format("label_image: {}\n", quotedText(additions.label_image));
}

}  // namespace hapticd::config
