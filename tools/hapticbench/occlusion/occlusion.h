// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "rt/base/vec3.h"
#include "rt/base/words.h"
#include "rt/depth/depth_frame.h"
#include "rt/laws/force_law.h"
#include "rt/loop/loop_state.h"
#include "tools/hapticbench/engine/laws.h"
#include "tools/hapticbench/engine/measures.h"
#include "tools/lib/truth/any_camera.h"
#include "tools/lib/truth/body_scene.h"
#include "tools/lib/truth/occluded_scene.h"

namespace hapticd::tools {

/// The action of the hand while a body passes between the camera and it.
enum class HandDuringPassage : std::uint8_t {
  free,      ///< 30 mm in front of the wall
  pressing,  ///< 6 mm behind the wall's front
  stroking,  ///< 8 mm behind it, 0.1 m/s to and fro
  entering,  ///< free; is pushed in 6 mm while it is hidden
  leaving,   ///< presses; is pulled back to 30 mm while it is hidden
};
constexpr auto wordsOf(HandDuringPassage) {
  return rt::words<HandDuringPassage>("free", "pressing", "stroking", "entering", "leaving");
}

/// A body that passes in front of a hand at a wall.
struct PassageCase {
  double wall_m = 1;
  HandDuringPassage hand = HandDuringPassage::free;
  OccluderShape shape = OccluderShape::box;
  double thickness_m = 0.08;
  double gap_m = 0.1;          ///< from the body's back to the HIP of the free hand, along the depth
  double speed_m_per_s = 0.3;  ///< of the body; negative: to the left
  double pause_s = 0;          ///< that it stays in front of the hand
  bool projector_shadow = true;
  SceneNoise noise = SceneNoise::none;
  std::uint32_t seed = 1;
};

/// Errors of a law from the start of the body's motion until half a second after it has left.
struct PassageResult {
  Exceedance ghost;   ///< force, over 0.1 N, at ticks where the HIP is in front of the wall
  Exceedance error;   ///< error against the true force, over 0.5 N, where it presses
  Exceedance change;  ///< difference from the force before the body set out, over 0.5 N, where the true force
                      ///< is as it was then
  std::size_t pressed = 0;  ///< ticks that press
  std::size_t lost = 0;     ///< of these, those with less than a tenth of the true force

  void add(const PassageResult& other);
};

/// The law's force and the true force at one tick.
struct PassageTick {
  rt::Vec3 force_n;
  rt::Vec3 true_n;  ///< zero where the HIP is in front of the wall
};

/// `before`: ticks before the body sets out, when the hand has already settled.
PassageResult judgePassage(const std::vector<PassageTick>& before, const std::vector<PassageTick>& during);

/// The position of the body, the action of the hand and the camera's frames, tick by tick, rendered once for
/// all laws. Thread: one at a time.  RT: not safe.
class Passage {
 public:
  explicit Passage(const PassageCase& passage);

  PassageResult run(const std::string& law);

  /// Ticks from the start to half a second after the body is gone.
  long end() const { return end_; }
  /// The middle of the body.
  double bodyX_m(long tick) const;
  rt::Vec3 hip_m(long tick) const;
  /// Penetration of the HIP into the wall; negative in front of it.
  double depth_m(long tick) const;

 private:
  const rt::DepthFrame& frame(int index);

  PassageCase case_;
  double back_m_;
  double sight_x_m_;  ///< of the body where it is before the hand
  long arrives_;      ///< there, at that tick
  long leaves_;
  long end_;
  OccludedScene scene_;
  std::vector<std::unique_ptr<rt::DepthFrame>> frames_;
};

/// The force on a HIP while the surface that it presses on comes nearer than the camera measures.
struct NearLimitResult {
  double force_n = 0;         ///< at the last tick before the surface was too near
  double held_ms = 0;         ///< from then on until the force was below half of that
  double least_held_n = 0;    ///< the smallest force in that time, the ramp of the release included
  double released_ms = 0;     ///< until it was below 5 % of it; negative: it never was
  double largest_step_n = 0;  ///< of the command from one tick to the next, from then on
  bool cause_named = false;   ///< the cause surface_too_near was in a tick from then on
  bool came_back = false;     ///< the force returned with the surface

  static NearLimitResult none() { return {.released_ms = -1}; }
};

/// One tick of such a run: the command along the normal of the surface, and the cause.
struct NearLimitTick {
  double outward_n = 0;
  rt::Cause cause = rt::Cause::none;
};

/// `too_near`: the first tick at which the surface is not measured; `back`: the first at which it is again.
NearLimitResult judgeNearLimit(const std::vector<NearLimitTick>& ticks, std::size_t too_near,
                               std::size_t back);

/// A wall approaches at that speed and passes the HIP, which is 6 mm behind it when it reaches the near limit
/// of the camera; it goes on for 30 mm, waits for two seconds and goes back.
NearLimitResult runNearLimit(const std::string& law, double speed_m_per_s);

/// A side of a block that faces the camera, as it lies in the image.
enum class BlockSide : std::uint8_t { left, right, up, down };
constexpr auto wordsOf(BlockSide) {
  return rt::words<BlockSide>("left", "right", "up", "down");
}
/// Unit vector out of the block through that side, in the camera's frame.
rt::Vec3 outOf(BlockSide side);
/// A block whose front is `wall_m` from the camera and 0.2 m wide, endless in depth. `side_m`: where that
/// side is along outOf(side), from the optical axis; negative: it faces the axis, so that the camera sees it.
TrueBody blockWithSide(BlockSide side, double side_m, double wall_m);

/// How a hand enters or leaves a body other than through the surface that the camera sees.
enum class EntryKind : std::uint8_t {
  visible_side,  ///< through a side of a block that faces the optical axis and is seen at a grazing angle
  hidden_side,   ///< through a side that the camera does not see
  from_behind,   ///< out of the depth behind the front, and out through the front
  into_image,    ///< behind the level of a wall, from beyond the image's border
  out_of_image,  ///< pressing on a wall, over the image's border
};
constexpr auto wordsOf(EntryKind) {
  return rt::words<EntryKind>("visible_side", "hidden_side", "from_behind", "into_image", "out_of_image");
}
bool isThroughSide(EntryKind kind);

struct EntryCase {
  EntryKind kind = EntryKind::hidden_side;
  BlockSide side = BlockSide::left;  ///< where isThroughSide()
  double wall_m = 1;
  double below_m = 0.02;       ///< of the hand, behind the level of the front
  double speed_m_per_s = 0.1;  ///< of the hand
  SceneNoise noise = SceneNoise::none;
  std::uint32_t seed = 1;
};

/// The force on a hand in or beside a body, and the true one.
struct EntryTick {
  rt::Vec3 force_n{};    ///< of the law
  rt::Vec3 blended_n{};  ///< the same after the blend, as the handle gets it
  rt::ContactState state = rt::ContactState::free;
  rt::Vec3 hip_m{};
  bool inside = false;    ///< the HIP is in the solid, by more than 2 mm or a pixel
  bool outside = false;   ///< the HIP is out of it, by more than that
  bool has_side = false;  ///< there is a side to come through, so that a force along the motion may be right
  rt::Vec3 true_n{};      ///< the spring to the surface that was touched: the side, or else the front
  rt::Vec3 front_n{};  ///< the spring to the front, of a HIP that came through a side; right where it is less
};

/// Ticks inside the body by the force that they got, and the largest forces that should not exist.
struct EntryResult {
  std::size_t inside = 0;
  std::size_t of_body = 0;        ///< ticks with the force of the body: isRightForce()
  std::size_t none_reported = 0;  ///< with no force, and the contact state is `behind`
  std::size_t none_silent = 0;    ///< with no force, and no report of it
  std::size_t wrong = 0;          ///< with another force
  double ghost_n = 0;             ///< largest force outside
  double sideways_n = 0;          ///< largest force along the motion where there is no side to come through
  double step_n = 0;  ///< largest change of the blended force in a tick beyond the spring of the HIP's motion
  double early_n = 0;    ///< largest force in the first 20 ms in the solid
  double angle_deg = 0;  ///< largest angle from the nearest right force, of forces above 0.5 N

  void add(const EntryResult& other);
};
/// While the force turns over from the side to a front that is nearer, any force between the two is right,
/// for as many ticks as the blend would take.
EntryResult judgeEntry(const std::vector<EntryTick>& ticks, double stiffness_n_per_m);

EntryResult runEntry(const std::string& law, const EntryCase& entry);

/// How the outline of a body comes over a hand that presses 8 mm into its front.
enum class OutlineMotion : std::uint8_t {
  aside,     ///< the body moves out from under the hand
  comes_on,  ///< towards the camera, so that the outline moves outwards in the image; the hand stays in it
};
constexpr auto wordsOf(OutlineMotion) {
  return rt::words<OutlineMotion>("moves aside", "comes on");
}

/// The body moves at 0.1 m/s.
struct OutlineCase {
  OutlineMotion motion = OutlineMotion::aside;
  BlockSide side = BlockSide::left;
  bool visible = true;  ///< the side at the outline; always where the surface comes on
  double wall_m = 1;
  double passes_at_m = 0.016;  ///< how deep the hand is when the outline of a surface that comes on passes it
  SceneNoise noise = SceneNoise::none;
  std::uint32_t seed = 1;
};

struct OutlineResult {
  int runs = 0;
  int not_pressed = 0;  ///< of them, without force before the body moved, so that nothing is judged
  int held = 0;         ///< in the end the force was more than half of its largest
  double drop_n = 0;    ///< largest fall of the force in one tick
  /// In how many frames of 33 ms the force fell from 90 to 10 % of the largest one of the ten frames before,
  /// or would have at the speed at which it fell to half; infinite where it fell more slowly or less.
  double fewest_frames = std::numeric_limits<double>::infinity();

  void add(const OutlineResult& other);
};
/// `force_n`: magnitudes by the tick since the body moves. `before_n`: the true one before.
OutlineResult judgeOutline(const std::vector<double>& force_n, double before_n);

OutlineResult runOutline(const std::string& law, const OutlineCase& outline);

/// The border of the surface that a push is next to.
enum class BorderKind : std::uint8_t {
  silhouette_hidden,   ///< a body's edge whose side the camera does not see
  silhouette_visible,  ///< a body's edge whose side it sees
  image_border,        ///< the last column that is measured
};
constexpr auto wordsOf(BorderKind) {
  return rt::words<BorderKind>("hidden side", "visible side", "image border");
}

/// A push straight in, 45 mm deep, beside a border.
struct BorderPushCase {
  BorderKind kind = BorderKind::silhouette_hidden;
  double wall_m = 1;
  double beside_m = 0.01;      ///< from the border, on the body
  double speed_m_per_s = 0.1;  ///< of the hand towards the surface, or of the surface towards the hand
  bool surface_moves = false;  ///< 60 mm, from 20 mm behind a HIP that is still
  SceneNoise noise = SceneNoise::none;
  std::uint32_t seed = 1;
};

struct BorderPushResult {
  int pushes = 0;
  int popped = 0;  ///< pushes that popped through below 20 N with the HIP's ray 3 px or more from the border
  int at_outline = 0;    ///< those that did so with the ray nearer to it, where nobody can tell
  double least_n = 1e9;  ///< smallest pop-through force, or the largest force reached

  void add(const BorderPushResult& other);
};

BorderPushResult runBorderPush(const std::string& law, const BorderPushCase& push);

}  // namespace hapticd::tools
