// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <expected>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "config/settings/label_image.h"
#include "config/solids/solid_file.h"
#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "rt/base/words.h"
#include "rt/fixtures/fixture.h"
#include "rt/tissue/tissue.h"

/// Virtual fixtures and tissue regions as people define them, in the configuration, in files and through the
/// control interface.
namespace hapticd::config {

/// A frame that rests in the world: that of a region, and of a fixture that names one of these two words.
enum class FixtureFrame : std::uint8_t { world, camera };
constexpr auto wordsOf(FixtureFrame) {
  return rt::words<FixtureFrame>("world", "camera");
}

/// What becomes of a fixture's force while the camera is lost.
enum class OnCameraLoss : std::uint8_t {
  automatic,  ///< fade for stand-offs, whose surface is lost with the camera; keep for all others
  keep,       ///< it goes on acting
  fade,       ///< it ends, as that of the force law does
};
constexpr auto wordsOf(OnCameraLoss) {
  return rt::words<OnCameraLoss>("auto", "keep", "fade");
}

/// Whose a fixture or region is: a reload of the configuration changes its own only.
enum class Origin : std::uint8_t { configuration, profile, client };
constexpr auto wordsOf(Origin) {
  return rt::words<Origin>("configuration", "profile", "client");
}

/// The origin as a member that is no part of what a fixture or region is: all are equal.
struct OriginMark {
  Origin value = Origin::configuration;

  friend constexpr bool operator==(const OriginMark&, const OriginMark&) { return true; }
};

/// One fixture. Vectors are in its frame; members that its kind does not use keep their defaults and must not
/// be given.
struct FixtureSettings {
  std::string name{};  ///< 1 to 32 letters, digits, '_' and '-'; unique
  rt::FixtureKind kind = rt::FixtureKind::sphere;
  rt::FixtureSide side = rt::FixtureSide::out;         ///< plane to cone
  rt::FixtureEffect effect = rt::FixtureEffect::hold;  ///< forbidden regions
  std::string frame = "world";  ///< world, camera, or the name of one of the list `frames`
  bool enabled = true;
  /// plane: a point of it; box, sphere: centre; capsule: first end; cone: tip; solid: origin of its frame;
  /// point
  rt::Vec3 position_m{};
  rt::Vec3 normal{0, 0, 1};  ///< plane: towards the free side; any length except zero
  rt::Vec3 axis{0, 0, 1};    ///< cone: from the tip into the cone; any length except zero
  rt::Vec3 end_m{};          ///< capsule: second end
  rt::Vec3 size_m{};         ///< box: its edges, each > 0
  rt::Vec3 rotation_deg{};  ///< box, solid: roll, pitch, yaw about the fixed axes of its frame, in this order
  double radius_m = 0;      ///< sphere, capsule
  double half_angle_deg = 30;        ///< cone
  std::string solid{};               ///< solid: SHA-256 of its file (config/solids/solid_file.h)
  std::vector<rt::Vec3> points_m{};  ///< path: 2 to kMaxPathPoints
  bool allow_crossing = false;       ///< path: it may cross itself
  double bend_radius_m = 0.005;  ///< path: its bends are arcs of this radius, or less where there is no room
  double clearance_m = 0;        ///< forbidden regions
  double warning_m = 0;          ///< forbidden regions; 0: none; otherwise more than soft_m
  double soft_m = 0;             ///< effect hold: the softer layer before the boundary; 0: none
  double soft_stiffness_n_per_m = 100;  ///< effect hold: at most stiffness_n_per_m
  double breach_m = 0.001;              ///< effect hold
  double viscosity_n_s_per_m = 5;       ///< effect slow
  double speed_limit_m_per_s = 0;       ///< effect slow
  double ramp_m = 0.005;                ///< effect slow
  double stiffness_n_per_m = 300;
  double damping_n_s_per_m = 1;
  double deadband_m = 0;  ///< guidance
  double max_force_n = 2;
  double fade_in_s = 0.5;
  double escape_force_n = 0;  ///< guidance
  OnCameraLoss on_camera_loss = OnCameraLoss::automatic;
  OriginMark origin{};

  friend bool operator==(const FixtureSettings&, const FixtureSettings&) = default;
};

/// One tissue region; the members are those of rt::TissueRegion.
struct RegionSettings {
  std::string name{};  ///< as of fixtures
  rt::TissuePlace place = rt::TissuePlace::shape;
  rt::ShapeKind shape = rt::ShapeKind::sphere;  ///< sphere, box or capsule
  FixtureFrame frame = FixtureFrame::world;
  rt::Vec3 position_m{};
  rt::Vec3 end_m{};
  rt::Vec3 size_m{};
  rt::Vec3 rotation_deg{};
  double radius_m = 0;
  int label = 0;  ///< 1..255, for the place `label`
  double transition_m = 0.01;
  rt::ContactModel model = rt::ContactModel::linear;
  double stiffness_n_per_m = 500;
  double exponent = 1.5;
  double damping_per_speed_s_per_m = 0;
  double lower_stiffness_n_per_m = 1000;
  double layer_m = 0.005;
  double damping_n_s_per_m = 0;
  double friction = 0;
  double cue_force_n = 0;
  double cue_hz = 22.3;
  OriginMark origin{};

  friend bool operator==(const RegionSettings&, const RegionSettings&) = default;
};

/// One frame that moves in the world; the members are those of rt::FrameRules.
struct FrameSettings {
  std::string name{};  ///< as of fixtures, but neither world nor camera
  rt::OnFrameLoss on_loss = rt::OnFrameLoss::fade;
  double timeout_s = 0.2;
  bool keepalive = true;
  double max_speed_m_per_s = 0.5;
  /// Name of a fixture of kind solid in this frame, which the depth camera follows; empty: poses are fed. At
  /// the start the frame is the world.
  std::string tracks{};
  OriginMark origin{};

  friend bool operator==(const FrameSettings&, const FrameSettings&) = default;
};

/// All that people add to the scene: the lists `frames`, `fixtures` and `regions` of a configuration or file.
struct SceneAdditions {
  std::vector<FixtureSettings> fixtures{};
  std::vector<RegionSettings> regions{};
  /// Portable graymap (P5, 8 bits) with a label for each pixel of the depth image; empty: none.
  std::string label_image{};
  OriginMark label_image_origin{};
  std::vector<FrameSettings> frames{};  ///< that move in the world, by name

  friend bool operator==(const SceneAdditions&, const SceneAdditions&) = default;
};

/// Returns how far from the boundary of its shape a forbidden region begins to act.
inline double beginning_m(const FixtureSettings& fixture) {
  return fixture.clearance_m + fixture.soft_m;
}

/// Returns the enabled stand-off that begins farthest from the surface, or null.
const FixtureSettings* widestStandoff(const std::vector<FixtureSettings>& fixtures);
/// Returns how far from the surface it begins, or 0.
double standoffClearance_m(const std::vector<FixtureSettings>& fixtures);

/// Returns whether a fixture is given in the frame of this name, which rests in the world.
inline bool isResting(std::string_view frame) {
  return frame == "world" || frame == "camera";
}
/// The number by which the force loop knows a frame; it follows from its name alone, and is not 0.
std::uint32_t frameIdentity(std::string_view name);
/// A frame in the form of the force loop.
rt::FrameRules rulesOf(const FrameSettings& frame);

/// Returns `keep` or `fade`, also where the fixture says `auto`.
OnCameraLoss effectiveOnCameraLoss(const FixtureSettings& fixture);

/// Rotation as a unit quaternion: how a box is turned in its frame.
struct Quaternion {
  double x = 0;
  double y = 0;
  double z = 0;
  double w = 1;
};
/// Converts between the two forms of a box's orientation; roll, pitch and yaw are about the fixed axes, in
/// this order. `orientation`: of length 1.
rt::Vec3 rotationOf(const Quaternion& orientation);
Quaternion orientationOf(const rt::Vec3& rotation_deg);

/// What is wrong with a fixture or region.
struct AdditionError {
  std::string name;   ///< of the fixture or region; empty: it has none
  std::string field;  ///< for example "radius_m"; empty: none in particular
  base::Error error;  ///< `where` holds file and line, or name and field
};

/// Reads `fixtures:`, `regions:` and `label_image:` from a YAML (or JSON) text, at most 1 MiB, which messages
/// call `name`, and checks everything including checkTogether().
/// Errors: each with name, field, reason and remedy; nothing is applied partially.
std::expected<SceneAdditions, std::vector<AdditionError>> additionsFromText(std::string_view text,
                                                                            const std::string& name);
/// Checks ranges, numbers, unique names and capacity. Errors: all of them.
std::vector<AdditionError> checkTogether(const SceneAdditions& additions);
/// Returns an error for each fixture that names a frame which is not in the list; checkTogether() leaves
/// this out, because a file of fixtures may belong to a configuration that has the frames.
std::vector<AdditionError> unknownFrames(const SceneAdditions& additions);

/// The text that reads back as the same; only members that the kind uses.
std::string textOf(const SceneAdditions& additions);

/// What fixtures refer to.
struct FixtureSurroundings {
  const rt::PoseParameters& T_world_camera;
  /// A fixture whose frame is not among these (at most rt::kMaxFrames) has no place, and exerts nothing.
  const std::vector<FrameSettings>& frames;
  /// A fixture whose solid is not among these does not act; they must outlive the set.
  const SolidTable& solids;
  double tool_radius_m = 0;  ///< forbidden regions are larger by it at each boundary
};

/// Converts checked fixtures to the form of the force loop, in the world frame. `set` keeps the identity of
/// fixtures by name, and the definition of those that differ in nothing but `enabled`; its generation is
/// incremented.
void toFixtureSet(const std::vector<FixtureSettings>& fixtures, const std::vector<FixtureSettings>& before,
                  const FixtureSurroundings& surroundings, rt::FixtureSet& set);
/// The same for regions. `image`: their label image, at most kMaxFrameWidth x kMaxFrameHeight; empty: none.
void toTissueMap(const std::vector<RegionSettings>& regions, const std::vector<RegionSettings>& before,
                 const LabelImage& image, const rt::PoseParameters& T_world_camera, rt::TissueMap& map);

}  // namespace hapticd::config
