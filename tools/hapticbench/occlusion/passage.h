// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "rt/depth_frame.h"
#include "rt/vec3.h"
#include "tools/hapticbench/statistics.h"
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
inline constexpr std::array kAllHands{HandDuringPassage::free, HandDuringPassage::pressing,
                                      HandDuringPassage::stroking, HandDuringPassage::entering,
                                      HandDuringPassage::leaving};
std::string_view nameOf(HandDuringPassage hand);

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

}  // namespace hapticd::tools
