// SPDX-License-Identifier: Apache-2.0
#include "config/additions/addition_fields.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "config/base/value_text.h"

namespace hapticd::config {
namespace {

using rt::FixtureKind;
using Fixture = FixtureSettings;
using Region = RegionSettings;

constexpr std::size_t kMaxNameLength = 32;
constexpr std::string_view kNameRange = "1 to 32 letters, digits, '_' and '-'";
constexpr std::string_view kFrameRange = "world, camera or one of the list frames";
constexpr std::string_view kHashRange = "64 hexadecimal digits in small letters";

// Metres. The smallest size that the scene can show at all is far above it.
constexpr double kMinSize_m = 0.0001;
constexpr double kFarthest_m = 10;

// A direction may have any length; this keeps its square within the numbers that a double can hold.
constexpr double kMaxDirection = 1e6;

template <typename Owner>
constexpr bool always(const Owner&) {
  return true;
}
template <typename Owner>
constexpr bool never(const Owner&) {
  return false;
}

template <FixtureKind... kinds>
constexpr bool isOf(const Fixture& fixture) {
  return ((fixture.kind == kinds) || ...);
}
constexpr bool isPlaced(const Fixture& fixture) {
  return fixture.kind != FixtureKind::standoff && fixture.kind != FixtureKind::path;
}
constexpr bool hasFrame(const Fixture& fixture) {
  return fixture.kind != FixtureKind::standoff;
}
constexpr bool isForbidden(const Fixture& fixture) {
  return !isGuidance(fixture.kind);
}
constexpr bool holds(const Fixture& fixture) {
  return isForbidden(fixture) && fixture.effect == rt::FixtureEffect::hold;
}
constexpr bool slows(const Fixture& fixture) {
  return isForbidden(fixture) && fixture.effect == rt::FixtureEffect::slow;
}
constexpr bool hasSpring(const Fixture& fixture) {
  return !slows(fixture);
}
constexpr bool hasSide(const Fixture& fixture) {
  return isForbidden(fixture) && fixture.kind != FixtureKind::standoff;
}
constexpr bool isGuide(const Fixture& fixture) {
  return isGuidance(fixture.kind);
}

constexpr bool hasShape(const Region& region) {
  return region.place == rt::TissuePlace::shape;
}
constexpr bool hasLabel(const Region& region) {
  return region.place == rt::TissuePlace::label;
}
template <rt::ShapeKind... shapes>
constexpr bool isShaped(const Region& region) {
  return hasShape(region) && ((region.shape == shapes) || ...);
}
template <rt::ContactModel... models>
constexpr bool isModel(const Region& region) {
  return ((region.model == models) || ...);
}

// The shapes of regions: those of rt::ShapeKind that are bounded.
constexpr std::array<std::string_view, 3> kShapeWords{"sphere", "box", "capsule"};
constexpr std::size_t kFirstShape = static_cast<std::size_t>(rt::ShapeKind::sphere);

template <auto kMember, typename Owner, typename Enumeration>
constexpr WordMember<Owner> wordsFor(std::span<const std::string_view> words) {
  return {words, [](const Owner& owner) { return static_cast<std::size_t>(owner.*kMember); },
          [](Owner& owner, std::size_t index) { owner.*kMember = static_cast<Enumeration>(index); }};
}
constexpr WordMember<Region> kShapeMember{
    kShapeWords, [](const Region& region) { return static_cast<std::size_t>(region.shape) - kFirstShape; },
    [](Region& region, std::size_t index) {
      region.shape = static_cast<rt::ShapeKind>(index + kFirstShape);
    }};

constexpr VectorMember<Fixture> vector(rt::Vec3 Fixture::*member, VectorUse use) {
  return {member, use};
}
constexpr VectorMember<Region> vector(rt::Vec3 Region::*member, VectorUse use) {
  return {member, use};
}

using enum FixtureKind;
using enum VectorUse;

// Columns: name, unit, member, minimum, maximum, where it is used, where it is required, help, and which
// value protects less.
// clang-format off
const std::array kFixtureFields = std::to_array<AdditionField<Fixture>>({
    {"name", "", &Fixture::name, 0, 0, always<Fixture>, always<Fixture>,
     "1 to 32 letters, digits, '_' and '-'; unique"},
    {"kind", "", wordsFor<&Fixture::kind, Fixture, FixtureKind>(rt::kWords<FixtureKind>), 0, 0,
     always<Fixture>, always<Fixture>,
     "what the fixture is"},
    {"side", "", wordsFor<&Fixture::side, Fixture, rt::FixtureSide>(rt::kWords<rt::FixtureSide>), 0, 0,
     hasSide, never<Fixture>,
     "side of the boundary on which the HIP is kept; both: the one where it was when the fixture began to act"},
    {"effect", "", wordsFor<&Fixture::effect, Fixture, rt::FixtureEffect>(rt::kWords<rt::FixtureEffect>), 0, 0,
     isForbidden, never<Fixture>,
     "hold: a spring holds the HIP off the region; slow: the HIP moves freely in it, against a force that only "
     "opposes its motion"},
    {"frame", "", &Fixture::frame, 0, 0, hasFrame, never<Fixture>,
     "frame of the vectors; one of the list frames moves, and the fixture with it"},
    {"enabled", "", &Fixture::enabled, 0, 0, always<Fixture>, never<Fixture>,
     "whether it acts", Looser::lower},
    {"position_m", "m", vector(&Fixture::position_m, place), -kFarthest_m, kFarthest_m, isPlaced, isPlaced,
     "plane: a point of it; box, sphere: centre; capsule: first end; cone: tip; solid: origin of its frame; "
     "point: the point"},
    {"normal", "", vector(&Fixture::normal, direction), -kMaxDirection, kMaxDirection,
     isOf<plane>, isOf<plane>,
     "towards the free side; any length except zero"},
    {"axis", "", vector(&Fixture::axis, direction), -kMaxDirection, kMaxDirection,
     isOf<cone>, isOf<cone>,
     "from the tip into the cone; any length except zero"},
    {"end_m", "m", vector(&Fixture::end_m, place), -kFarthest_m, kFarthest_m, isOf<capsule>, isOf<capsule>,
     "second end"},
    {"size_m", "m", vector(&Fixture::size_m, size), kMinSize_m, kFarthest_m, isOf<box>, isOf<box>,
     "lengths of the edges"},
    {"rotation_deg", "deg", vector(&Fixture::rotation_deg, angles), -360, 360, isOf<box, solid>,
     never<Fixture>,
     "roll, pitch and yaw about the fixed axes x, y and z of the frame, in this order"},
    {"orientation_xyzw", "", QuaternionMember<Fixture>{&Fixture::rotation_deg, "rotation_deg"}, -1, 1,
     isOf<box, solid>, never<Fixture>,
     "the rotation as a unit quaternion, instead of rotation_deg"},
    {"radius_m", "m", &Fixture::radius_m, kMinSize_m, kFarthest_m,
     isOf<sphere, capsule>, isOf<sphere, capsule>,
     "radius"},
    {"half_angle_deg", "deg", &Fixture::half_angle_deg, 1, 85, isOf<cone>, never<Fixture>,
     "angle between the axis and the side of the cone"},
    {"solid", "", &Fixture::solid, 0, 0, isOf<solid>, isOf<solid>,
     "SHA-256 of the file with its shape, which fixture add --mesh and --labels send"},
    {"points_m", "m", &Fixture::points_m, -kFarthest_m, kFarthest_m, isOf<path>, isOf<path>,
     "2 to 256 points of the path, neighbours at least 0.0005 m apart, no turn over 175 degrees; closed where "
     "the last is the first"},
    {"allow_crossing", "", &Fixture::allow_crossing, 0, 0, isOf<path>, never<Fixture>,
     "whether the path may come within 0.001 m of itself"},
    {"bend_radius_m", "m", &Fixture::bend_radius_m, 0.0005, 0.1, isOf<path>, never<Fixture>,
     "bends are arcs of this radius, or less where there is no room"},
    {"clearance_m", "m", &Fixture::clearance_m, 0, 0.05, isForbidden, isOf<standoff>,
     "the HIP is kept this far from the boundary; of a standoff: from the visible surface, above 0", Looser::lower},
    {"warning_m", "m", &Fixture::warning_m, 0, 0.1, isForbidden, never<Fixture>,
     "nearer than this the fixture's stage is warning, and is counted; more than soft_m; 0: no warning",
     Looser::lower},
    {"soft_m", "m", &Fixture::soft_m, 0, 0.05, holds, never<Fixture>,
     "thickness of a softer layer before the boundary; 0: none", Looser::lower},
    {"soft_stiffness_n_per_m", "N/m", &Fixture::soft_stiffness_n_per_m, 1, 5000, holds, never<Fixture>,
     "stiffness of that layer; at most stiffness_n_per_m", Looser::lower},
    {"breach_m", "m", &Fixture::breach_m, 0.0001, 0.05, holds, never<Fixture>,
     "deeper than this behind the boundary is a breach", Looser::higher},
    {"viscosity_n_s_per_m", "N s/m", &Fixture::viscosity_n_s_per_m, 0.1, 50, slows, never<Fixture>,
     "force against the motion for each m/s above the speed limit", Looser::lower},
    {"speed_limit_m_per_s", "m/s", &Fixture::speed_limit_m_per_s, 0, 1, slows, never<Fixture>,
     "no force up to this speed; 0: at any speed, as in a viscous medium", Looser::higher},
    {"ramp_m", "m", &Fixture::ramp_m, 0.0005, 0.05, slows, never<Fixture>,
     "the force rises to its full size over this depth behind the boundary", Looser::higher},
    {"stiffness_n_per_m", "N/m", &Fixture::stiffness_n_per_m, 1, 5000, hasSpring, never<Fixture>,
     "stiffness of the spring that holds the HIP off the region or pulls it to the path or point", Looser::lower},
    {"damping_n_s_per_m", "N s/m", &Fixture::damping_n_s_per_m, 0, 50, hasSpring, never<Fixture>,
     "forbidden region: while approaching; guidance: across the path", Looser::never},
    {"deadband_m", "m", &Fixture::deadband_m, 0, 0.1, isGuide, never<Fixture>,
     "no force up to this distance from the path or point"},
    {"max_force_n", "N", &Fixture::max_force_n, 0.05, 40, always<Fixture>, never<Fixture>,
     "largest force; it limits the force, never where the proxy is", Looser::lower},
    {"fade_in_s", "s", &Fixture::fade_in_s, 0, 10, always<Fixture>, never<Fixture>,
     "time over which the fixture begins to act", Looser::higher},
    {"escape_force_n", "N", &Fixture::escape_force_n, 0, 40, isGuide, never<Fixture>,
     "above this force the guidance gives way; 0: never"},
    {"on_camera_loss", "", wordsFor<&Fixture::on_camera_loss, Fixture, OnCameraLoss>(rt::kWords<OnCameraLoss>), 0, 0,
     always<Fixture>, never<Fixture>,
     "whether it goes on acting while the camera is lost; auto: fade for a standoff, keep for others"},
});

const std::array kRegionFields = std::to_array<AdditionField<Region>>({
    {"name", "", &Region::name, 0, 0, always<Region>, always<Region>,
     "1 to 32 letters, digits, '_' and '-'; unique"},
    {"place", "", wordsFor<&Region::place, Region, rt::TissuePlace>(kPlaceWords), 0, 0,
     always<Region>, never<Region>,
     "where the region is: inside a shape, or where the label image has its label"},
    {"shape", "", kShapeMember, 0, 0, hasShape, hasShape,
     "shape of the region"},
    {"frame", "", wordsFor<&Region::frame, Region, FixtureFrame>(rt::kWords<FixtureFrame>), 0, 0,
     hasShape, never<Region>,
     "frame of the vectors; a region cannot move with one of the list frames"},
    {"position_m", "m", vector(&Region::position_m, place), -kFarthest_m, kFarthest_m, hasShape, hasShape,
     "sphere, box: centre; capsule: first end"},
    {"end_m", "m", vector(&Region::end_m, place), -kFarthest_m, kFarthest_m,
     isShaped<rt::ShapeKind::capsule>, isShaped<rt::ShapeKind::capsule>,
     "second end"},
    {"size_m", "m", vector(&Region::size_m, size), kMinSize_m, kFarthest_m,
     isShaped<rt::ShapeKind::box>, isShaped<rt::ShapeKind::box>,
     "lengths of the edges"},
    {"rotation_deg", "deg", vector(&Region::rotation_deg, angles), -360, 360,
     isShaped<rt::ShapeKind::box>, never<Region>,
     "roll, pitch and yaw about the fixed axes x, y and z of the frame, in this order"},
    {"orientation_xyzw", "", QuaternionMember<Region>{&Region::rotation_deg, "rotation_deg"}, -1, 1,
     isShaped<rt::ShapeKind::box>, never<Region>,
     "the rotation as a unit quaternion, instead of rotation_deg"},
    {"radius_m", "m", &Region::radius_m, kMinSize_m, kFarthest_m,
     isShaped<rt::ShapeKind::sphere, rt::ShapeKind::capsule>,
     isShaped<rt::ShapeKind::sphere, rt::ShapeKind::capsule>,
     "radius"},
    {"label", "", &Region::label, 1, 255, hasLabel, hasLabel,
     "grey value of the region in the label image"},
    {"transition_m", "m", &Region::transition_m, 0.002, 0.1, always<Region>, never<Region>,
     "width over which the contact passes to that of the surroundings, half of it inside; the same for "
     "all regions of place label"},
    {"model", "", wordsFor<&Region::model, Region, rt::ContactModel>(rt::kWords<rt::ContactModel>), 0, 0,
     always<Region>, never<Region>,
     "how the force depends on the depth of the HIP below the surface"},
    {"stiffness_n_per_m", "N/m", &Region::stiffness_n_per_m, 1, 5000, always<Region>, never<Region>,
     "stiffness of the contact; hunt_crossley: the secant stiffness at a depth of 0.005 m"},
    {"exponent", "", &Region::exponent, 1, 2, isModel<rt::ContactModel::hunt_crossley>, never<Region>,
     "exponent of the depth; 1.5: a sphere on an elastic half-space"},
    {"damping_per_speed_s_per_m", "s/m", &Region::damping_per_speed_s_per_m, 0, 5,
     isModel<rt::ContactModel::hunt_crossley>, never<Region>,
     "damping in proportion to the elastic force and to the speed of penetration"},
    {"lower_stiffness_n_per_m", "N/m", &Region::lower_stiffness_n_per_m, 1, 5000,
     isModel<rt::ContactModel::layered>, never<Region>,
     "stiffness below the layer"},
    {"layer_m", "m", &Region::layer_m, 0.0005, 0.05, isModel<rt::ContactModel::layered>, never<Region>,
     "thickness of the layer"},
    {"damping_n_s_per_m", "N s/m", &Region::damping_n_s_per_m, 0, 50,
     isModel<rt::ContactModel::linear, rt::ContactModel::layered>, never<Region>,
     "damping along the surface normal"},
    {"friction", "", &Region::friction, 0, 2, always<Region>, never<Region>,
     "Coulomb friction coefficient"},
    {"cue_force_n", "N", &Region::cue_force_n, 0, 0.3, always<Region>, never<Region>,
     "amplitude of the palpation cue, a vibration along the surface; 0: none"},
    {"cue_hz", "Hz", &Region::cue_hz, 1, 250, always<Region>, never<Region>,
     "frequency of the palpation cue"},
});

const std::array kFrameFields = std::to_array<AdditionField<FrameSettings>>({
    {"name", "", &FrameSettings::name, 0, 0, always<FrameSettings>, always<FrameSettings>,
     "1 to 32 letters, digits, '_' and '-'; unique; neither world nor camera"},
    {"on_loss", "", wordsFor<&FrameSettings::on_loss, FrameSettings, rt::OnFrameLoss>(rt::kWords<rt::OnFrameLoss>), 0, 0,
     always<FrameSettings>, never<FrameSettings>,
     "when poses stop coming: hold: its fixtures stay where they are; fade: their force ends; stop: all force of the box"},
    {"timeout_s", "s", &FrameSettings::timeout_s, 0.05, 10, always<FrameSettings>, never<FrameSettings>,
     "the frame is lost when its newest pose is older"},
    {"keepalive", "", &FrameSettings::keepalive, 0, 0, always<FrameSettings>, never<FrameSettings>,
     "whether the source repeats poses that have not changed; false: silence means that nothing moves, and is no loss"},
    {"max_speed_m_per_s", "m/s", &FrameSettings::max_speed_m_per_s, 0.01, rt::kFastestFrame_m_per_s,
     always<FrameSettings>, never<FrameSettings>,
     "largest speed of the frame's origin; ten times as many radians per second are the largest of its turning"},
    {"tracks", "", &FrameSettings::tracks, 0, 0, always<FrameSettings>, never<FrameSettings>,
     "a fixture of kind solid in this frame, which the depth camera follows; empty: poses are fed"},
});
// clang-format on

}  // namespace

std::span<const AdditionField<FrameSettings>> frameFields() {
  return kFrameFields;
}

std::span<const AdditionField<FixtureSettings>> fixtureFields() {
  return kFixtureFields;
}

std::span<const AdditionField<RegionSettings>> regionFields() {
  return kRegionFields;
}

std::string variantOf(const FixtureSettings& fixture) {
  return fmt::format("kind {}{}", rt::wordOf(fixture.kind), slows(fixture) ? " and effect slow" : "");
}

std::string variantOf(const FrameSettings&) {
  return "any kind";
}

std::string variantOf(const RegionSettings& region) {
  const std::string place =
      hasLabel(region) ? "place label" : "shape " + std::string(rt::wordOf(region.shape));
  return fmt::format("{} and model {}", place, rt::wordOf(region.model));
}

bool isAdditionName(std::string_view name) {
  return !name.empty() && name.size() <= kMaxNameLength &&
         name.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-") ==
             std::string_view::npos;
}

template <typename Owner>
std::string rangeOf(const AdditionField<Owner>& field) {
  const auto numbers = [&field](std::string_view form) {
    const std::string range =
        fmt::format("{}..{}", base::numberText(field.minimum), base::numberText(field.maximum));
    return fmt::format(fmt::runtime(form),
                       field.unit.empty() ? range : fmt::format("{} {}", range, field.unit));
  };
  return std::visit(Overloaded{[&](std::string Owner::*) {
                                 if (field.name == "name" || field.name == "tracks")
                                   return std::string(kNameRange);
                                 return std::string(field.name == "frame" ? kFrameRange : kHashRange);
                               },
                               [](bool Owner::*) -> std::string { return "true or false"; },
                               [&](int Owner::*) { return numbers("whole number {}"); },
                               [&](double Owner::*) { return numbers("{}"); },
                               [&](std::vector<rt::Vec3> Owner::*) {
                                 return numbers("2 to 256 points [x, y, z], each {}");
                               },
                               [](const WordMember<Owner>& member) {
                                 return fmt::format("one of: {}", fmt::join(member.words, ", "));
                               },
                               [&](const VectorMember<Owner>& member) {
                                 return member.use == direction ? "[x, y, z], any length except zero"
                                                                : numbers("[x, y, z], each {}");
                               },
                               [](const QuaternionMember<Owner>& member) {
                                 return fmt::format("[x, y, z, w] of length 1, without {}", member.vector);
                               }},
                    field.member);
}
template std::string rangeOf(const AdditionField<FixtureSettings>&);
template std::string rangeOf(const AdditionField<RegionSettings>&);
template std::string rangeOf(const AdditionField<FrameSettings>&);

}  // namespace hapticd::config
