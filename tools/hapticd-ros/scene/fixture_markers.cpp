// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/scene/fixture_markers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <set>
#include <string_view>
#include <utility>

#include "rt/base/pose.h"
#include "tools/hapticd-ros/box/box_view.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools::ros {

namespace {

using Kind = Marker::Kind;
using trace::ros::Colour;

/// What has no end is drawn as large as on the page of hapticd-view.
constexpr double kPlaneEdge_m = 0.4;
constexpr double kPlaneThickness_m = 0.001;
constexpr double kConeSide_m = 0.15;
constexpr int kConeSegments = 24;
constexpr double kArrow_m = 0.05;
constexpr double kPointDiameter_m = 0.012;
constexpr double kLine_m = 0.002;
constexpr double kLetter_m = 0.02;

std::optional<rt::Vec3> vectorOf(const Json& json) {
  if (!json.is_array() || json.size() != 3) return std::nullopt;
  std::array<double, 3> numbers{};
  for (std::size_t i = 0; i < 3; ++i) {
    if (!json[i].is_number()) return std::nullopt;
    numbers[i] = json[i].get<double>();
  }
  const rt::Vec3 v{numbers[0], numbers[1], numbers[2]};
  return rt::isFinite(v) ? std::optional(v) : std::nullopt;
}

/// The vector with this name; `otherwise` where the definition has none.
std::optional<rt::Vec3> member(const Json& definition, const char* name, const rt::Vec3& otherwise) {
  const Json* const json = fieldAt(definition, name);
  return json == nullptr ? otherwise : vectorOf(*json);
}

/// The direction of a vector; nothing where it has none.
std::optional<rt::Vec3> directionOf(const std::optional<rt::Vec3>& v) {
  if (!v || !(rt::norm(*v) > 0)) return std::nullopt;
  return 1 / rt::norm(*v) * *v;
}

rt::Quaternion turnOf(const rt::Vec3& rotation_deg) {
  constexpr double kRadPerDeg = std::numbers::pi / 180;
  const rt::Vec3 angles = kRadPerDeg * rotation_deg;
  return rt::quaternionOf(rt::rotationOf({{}, angles.x, angles.y, angles.z}));
}

rt::RigidPose combined(const rt::RigidPose& T_a_b, const rt::RigidPose& T_b_c) {
  return {rt::placed(T_a_b, T_b_c.position_m_in_world), T_a_b.orientation * T_b_c.orientation};
}

std::string textOrNothing(const Json& definition, const char* name) {
  const Json* const text = fieldAt(definition, name);
  return text != nullptr && text->is_string() ? printable(text->get<std::string>()) : std::string();
}

std::string frameOf(const Json& definition) {
  const std::string frame = textOrNothing(definition, "frame");
  return frame.empty() ? "world" : frame;
}

bool isGuidance(const std::string& kind) {
  return kind == "path" || kind == "point";
}

/// Without opacity.
Colour colourOf(const Json& definition) {
  if (isGuidance(textOrNothing(definition, "kind"))) return {0.1F, 0.8F, 0.2F, 0};
  if (textOrNothing(definition, "effect") == "slow") return {0.95F, 0.85F, 0.1F, 0};
  if (textOrNothing(definition, "side") == "in") return {0.15F, 0.35F, 1, 0};
  return {0.9F, 0.1F, 0.1F, 0};
}

/// The markers of one fixture, in its own frame until place() has moved them to the world.
class Shapes {
 public:
  Shapes(std::string name, const Json& definition, bool is_enabled)
      : name_(std::move(name)),
        definition_(definition),
        colour_(colourOf(definition)),
        share_(is_enabled ? 1 : 0.3F) {}

  /// Adds the shape; false where it has none, or a member does not say what it should.
  bool add(const FixtureSurroundings& surroundings);
  void place(const rt::RigidPose& T_world_frame) {
    for (Marker& marker : markers_) marker.T_frame_marker = combined(T_world_frame, marker.T_frame_marker);
  }
  std::vector<Marker> take() { return std::move(markers_); }

 private:
  static constexpr float kBody = 0.35F;  // opacity: what is behind a body stays visible
  static constexpr float kLine = 0.9F;

  Marker& add(Kind kind, float opacity) {
    Marker& marker = markers_.emplace_back();
    marker.name = name_;
    marker.id = static_cast<std::int32_t>(markers_.size()) - 1;
    marker.kind = kind;
    marker.colour = colour_;
    marker.colour[3] = opacity * share_;
    return marker;
  }
  void addBall(const rt::Vec3& centre, double diameter_m, float opacity) {
    Marker& ball = add(Kind::sphere, opacity);
    ball.T_frame_marker.position_m_in_world = centre;
    ball.scale_m = {diameter_m, diameter_m, diameter_m};
  }
  bool addBox(const rt::Vec3& at);
  bool addSphere(const rt::Vec3& at);
  bool addPlane(const rt::Vec3& at);
  bool addCapsule(const rt::Vec3& at);
  bool addCone(const rt::Vec3& at);
  bool addPath();
  bool addSolid(const rt::Vec3& at, const FixtureSurroundings& surroundings);

  std::string name_;
  const Json& definition_;
  Colour colour_;
  float share_;  // of the opacity
  std::vector<Marker> markers_;
};

bool Shapes::add(const FixtureSurroundings& surroundings) {
  const std::string kind = textOrNothing(definition_, "kind");
  if (kind == "path") return addPath();
  const auto at = member(definition_, "position_m", {});
  if (!at) return false;
  if (kind == "sphere") return addSphere(*at);
  if (kind == "box") return addBox(*at);
  if (kind == "plane") return addPlane(*at);
  if (kind == "capsule") return addCapsule(*at);
  if (kind == "cone") return addCone(*at);
  if (kind == "solid") return addSolid(*at, surroundings);
  if (kind != "point") return false;
  addBall(*at, kPointDiameter_m, kLine);
  return true;
}

bool Shapes::addSphere(const rt::Vec3& at) {
  const double radius_m = numberAt(definition_, "radius_m");
  if (!(radius_m > 0)) return false;
  addBall(at, 2 * radius_m, kBody);
  return true;
}

bool Shapes::addBox(const rt::Vec3& at) {
  const auto size_m = member(definition_, "size_m", {});
  const auto rotation_deg = member(definition_, "rotation_deg", {});
  if (!size_m || !rotation_deg || !(std::min({size_m->x, size_m->y, size_m->z}) > 0)) return false;
  Marker& box = add(Kind::cube, kBody);
  box.T_frame_marker = {at, turnOf(*rotation_deg)};
  box.scale_m = *size_m;
  return true;
}

/// A square around its point, and an arrow to the side on which the hand may be.
bool Shapes::addPlane(const rt::Vec3& at) {
  const auto normal = directionOf(member(definition_, "normal", {0, 0, 1}));
  if (!normal) return false;
  Marker& square = add(Kind::cube, kBody);
  square.T_frame_marker = {at, rt::shortestRotation({0, 0, 1}, *normal)};
  square.scale_m = {kPlaneEdge_m, kPlaneEdge_m, kPlaneThickness_m};
  const std::string side = textOrNothing(definition_, "side");
  if (side == "both") return true;
  Marker& arrow = add(Kind::arrow, kLine);
  arrow.scale_m = {2 * kLine_m, 4 * kLine_m, 6 * kLine_m};  // diameters of shaft and head, length of the head
  arrow.points_m = {at, at + (side == "in" ? -kArrow_m : kArrow_m) * *normal};
  return true;
}

bool Shapes::addCapsule(const rt::Vec3& at) {
  const auto end = member(definition_, "end_m", {});
  const double radius_m = numberAt(definition_, "radius_m");
  if (!end || !(radius_m > 0)) return false;
  addBall(at, 2 * radius_m, kBody);
  const rt::Vec3 along = *end - at;
  if (!(rt::norm(along) > 0)) return true;
  addBall(*end, 2 * radius_m, kBody);
  Marker& cylinder = add(Kind::cylinder, kBody);
  cylinder.T_frame_marker = {at + 0.5 * along, rt::shortestRotation({0, 0, 1}, along)};
  cylinder.scale_m = {2 * radius_m, 2 * radius_m, rt::norm(along)};
  return true;
}

/// The mantle up to a length, since a cone has no end.
bool Shapes::addCone(const rt::Vec3& at) {
  const auto axis = directionOf(member(definition_, "axis", {0, 0, 1}));
  const Json* const angle = fieldAt(definition_, "half_angle_deg");
  const double half_angle_rad =
      (angle == nullptr ? 30 : numberAt(definition_, "half_angle_deg")) * std::numbers::pi / 180;
  if (!axis || !(half_angle_rad > 0 && half_angle_rad < std::numbers::pi / 2)) return false;
  Marker& cone = add(Kind::triangles, kBody);
  cone.T_frame_marker = {at, rt::shortestRotation({0, 0, 1}, *axis)};
  const auto rim = [half_angle_rad](int segment) {
    const double angle_rad = 2 * std::numbers::pi * (segment % kConeSegments) / kConeSegments;
    const double radius_m = kConeSide_m * std::sin(half_angle_rad);
    return rt::Vec3{radius_m * std::cos(angle_rad), radius_m * std::sin(angle_rad),
                    kConeSide_m * std::cos(half_angle_rad)};
  };
  for (int segment = 0; segment < kConeSegments; ++segment) {
    for (const rt::Vec3& corner : {rt::Vec3{}, rim(segment), rim(segment + 1)})
      cone.points_m.push_back(corner);
  }
  return true;
}

bool Shapes::addPath() {
  std::vector<rt::Vec3> points;
  for (const Json& json : listAt(definition_, "points_m")) {
    const auto point = vectorOf(json);
    if (!point) return false;
    points.push_back(*point);
  }
  if (points.size() < 2) return false;
  Marker& line = add(Kind::line_strip, kLine);
  line.scale_m = {kLine_m, 0, 0};
  line.points_m = std::move(points);
  return true;
}

bool Shapes::addSolid(const rt::Vec3& at, const FixtureSurroundings& surroundings) {
  const auto outline = surroundings.outlines.find(textOrNothing(definition_, "solid"));
  const auto rotation_deg = member(definition_, "rotation_deg", {});
  if (outline == surroundings.outlines.end() || !rotation_deg) return false;
  std::vector<rt::Vec3> ends;
  for (const std::vector<double>& line : outline->second) {
    for (std::size_t i = 0; i + 5 < line.size(); i += 3) {
      ends.push_back({line[i], line[i + 1], line[i + 2]});
      ends.push_back({line[i + 3], line[i + 4], line[i + 5]});
    }
  }
  if (ends.empty()) return false;
  Marker& lines = add(Kind::line_list, kLine);
  lines.T_frame_marker = {at, turnOf(*rotation_deg)};
  lines.scale_m = {kLine_m / 2, 0, 0};
  lines.points_m = std::move(ends);
  return true;
}

/// Pose of the frame of a fixture in the world; nothing: it is not known.
std::optional<rt::RigidPose> poseOf(const std::string& frame, const FixtureSurroundings& surroundings) {
  if (frame == "world") return rt::RigidPose{};
  if (frame == "camera") return surroundings.T_world_camera;
  const auto found = surroundings.frames.find(frame);
  return found == surroundings.frames.end() ? std::nullopt : std::optional(found->second);
}

/// Says what cannot be drawn.
std::string captionOf(const std::string& name, const Json& definition, bool is_placed) {
  const std::string kind = textOrNothing(definition, "kind");
  if (kind == "standoff") {
    const double clearance_mm = 1000 * numberAt(definition, "clearance_m");
    return fmt::format("{}: {} mm off the surface", name, fixed(clearance_mm, 1));
  }
  if (!is_placed)
    return fmt::format("{}: {} in {}, whose pose is not known", name, kind, frameOf(definition));
  return fmt::format("{}: {}", name, kind);
}

/// A line of text: at `place`, in the world.
Marker captionAt(const rt::Vec3& place, const std::string& name, const Json& definition, bool is_enabled,
                 bool is_placed) {
  Marker caption;
  caption.name = name;
  caption.kind = Kind::text;
  caption.T_frame_marker.position_m_in_world = place;
  caption.scale_m = {0, 0, kLetter_m};
  caption.colour = colourOf(definition);
  caption.colour[3] = is_enabled ? 1 : 0.3F;
  caption.text = captionOf(name, definition, is_placed);
  return caption;
}

}  // namespace

bool isInMovingFrame(const Json& definition) {
  const std::string frame = frameOf(definition);
  return frame != "world" && frame != "camera";
}

std::vector<Marker> fixtureMarkers(const Json& fixtures, const FixtureSurroundings& surroundings) {
  std::vector<Marker> all;
  int without_place = 0;
  static const Json none = Json::object();
  for (const Json& entry : fixtures) {
    const Json* const given = fieldAt(entry, "definition");
    const Json& definition = given != nullptr && given->is_object() ? *given : none;
    const std::string name = textAt(entry, "name");
    const bool is_enabled = flagAt(entry, "enabled");
    const auto T_world_frame = poseOf(frameOf(definition), surroundings);
    Shapes shapes(name, definition, is_enabled);
    if (T_world_frame && shapes.add(surroundings)) {
      shapes.place(*T_world_frame);
      std::ranges::move(shapes.take(), std::back_inserter(all));
      continue;
    }
    const auto own = member(definition, "position_m", {});
    if (T_world_frame && own && textOrNothing(definition, "kind") != "standoff") {
      all.push_back(captionAt(rt::placed(*T_world_frame, *own), name, definition, is_enabled, true));
      continue;
    }
    // at the camera, one below the other
    const rt::Vec3 place{0, -1.5 * kLetter_m * without_place++, 0};
    const rt::RigidPose at_camera = surroundings.T_world_camera.value_or(rt::RigidPose{});
    all.push_back(
        captionAt(rt::placed(at_camera, place), name, definition, is_enabled, T_world_frame.has_value()));
  }
  return all;
}

namespace {

/// The numbers of an array of `Count`; nothing where it is not that.
template <std::size_t Count>
std::optional<std::array<double, Count>> numbersOf(const Json& entry, const char* name) {
  const Json& list = listAt(entry, name);
  std::array<double, Count> numbers{};
  if (list.size() != Count) return std::nullopt;
  for (std::size_t i = 0; i < Count; ++i) {
    if (!list[i].is_number()) return std::nullopt;
    numbers[i] = list[i].template get<double>();
    if (!std::isfinite(numbers[i])) return std::nullopt;
  }
  return numbers;
}

std::optional<rt::RigidPose> poseOf(const Json& frame) {
  const auto position = numbersOf<3>(frame, "positionM");
  const auto turn = numbersOf<4>(frame, "orientationXyzw");
  if (!position || !turn) return std::nullopt;
  const rt::Quaternion q{(*turn)[0], (*turn)[1], (*turn)[2], (*turn)[3]};
  if (!(rt::dot(q, q) > 0)) return std::nullopt;
  return rt::RigidPose{{(*position)[0], (*position)[1], (*position)[2]}, rt::normalised(q)};
}

std::vector<std::vector<double>> linesOf(const Json& solid) {
  std::vector<std::vector<double>> lines;
  for (const Json& line : listAt(solid, "outline")) {
    std::vector<double>& numbers = lines.emplace_back();
    for (const Json& number : line) numbers.push_back(number.is_number() ? number.get<double>() : 0);
  }
  return lines;
}

}  // namespace

ClientResult<Json> FixtureWatch::call(const std::string& method, const Json& parameters) {
  if (!link_) {
    auto connected = VarlinkClient::connect(socket_);
    if (!connected) return std::unexpected(connected.error());
    link_.emplace(std::move(*connected));
    link_->interruptBy(interrupt_);
  }
  auto reply = link_->call("io.hapticd.Status." + method, parameters, kSilence);
  // a late reply would be taken for that of the next call
  if (!reply && reply.error().kind != ClientError::Kind::error_reply) link_.reset();
  return reply;
}

bool FixtureWatch::forget() {
  fixtures_ = Json::array();
  surroundings_ = {};
  return false;
}

bool FixtureWatch::refresh() {
  return (askForFixtures() && askForCamera() && askForSolids() && refreshFrames()) || forget();
}

bool FixtureWatch::askForFixtures() {
  const auto reply = call("ListFixtures");
  if (!reply) return false;
  fixtures_ = listAt(*reply, "fixtures");
  return true;
}

bool FixtureWatch::askForCamera() {
  const auto reply = call("GetCalibration");
  if (!reply) return false;
  surroundings_.T_world_camera.reset();
  for (const FixedFrame& frame : fixedFrames(*reply, Json::object(), "")) {
    if (frame.name == "camera") surroundings_.T_world_camera = frame.T_parent_frame;
  }
  return true;
}

/// Each solid once; those that no fixture has any longer are forgotten.
bool FixtureWatch::askForSolids() {
  std::set<std::string> needed;
  for (const Json& fixture : fixtures_) {
    const Json* const solid = fieldAt(fixture, "definition.solid");
    if (solid != nullptr && solid->is_string()) needed.insert(solid->get<std::string>());
  }
  std::erase_if(surroundings_.outlines, [&](const auto& known) { return !needed.contains(known.first); });
  for (const std::string& solid : needed) {
    if (surroundings_.outlines.contains(solid)) continue;
    const auto reply = call("GetSolid", {{"solid", solid}});
    if (reply) {
      surroundings_.outlines[solid] = linesOf(*reply);
    } else if (reply.error().kind != ClientError::Kind::error_reply) {
      return false;
    }
  }
  return true;
}

bool FixtureWatch::refreshFrames() {
  surroundings_.frames.clear();
  if (!anyMoves()) return true;
  const auto reply = call("ListFrames");
  if (!reply) return forget();
  for (const Json& frame : listAt(*reply, "frames")) {
    const auto pose = poseOf(frame);
    if (pose && textAt(frame, "state") != "none") surroundings_.frames[textAt(frame, "name")] = *pose;
  }
  return true;
}

bool FixtureWatch::anyMoves() const {
  return std::ranges::any_of(fixtures_, [](const Json& fixture) {
    const Json* const definition = fieldAt(fixture, "definition");
    return definition != nullptr && isInMovingFrame(*definition);
  });
}

}  // namespace hapticd::tools::ros
