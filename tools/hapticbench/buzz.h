// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "tools/hapticbench/engine/laws.h"

namespace hapticd::tools {

/// What a hand does with a device on a surface.
enum class BuzzHand : std::uint8_t {
  still,     ///< presses
  stroking,  ///< presses and strokes to and fro at 0.1 m/s
};
inline constexpr std::array kBuzzHands{BuzzHand::still, BuzzHand::stroking};
std::string_view nameOf(BuzzHand hand);

enum class BuzzScene : std::uint8_t {
  still,
  breathing,  ///< 20 mm from end to end, 0.25 Hz, along the optical axis
};
inline constexpr std::array kBuzzScenes{BuzzScene::still, BuzzScene::breathing};
std::string_view nameOf(BuzzScene scene);

/// One cause of vibration is left out.
enum class BuzzWithout : std::uint8_t {
  nothing,  ///< all is as shipped
  noise,    ///< of the camera: exact depth
  encoder,  ///< the position is not rounded
  frames,   ///< no new frame comes once contact has settled; the last one counts as new. Not of a scene that
            ///< moves, which would be two changes at once
  damping,  ///< of contact
};
inline constexpr std::array kBuzzCauses{BuzzWithout::nothing, BuzzWithout::noise, BuzzWithout::encoder,
                                        BuzzWithout::frames, BuzzWithout::damping};
std::string_view nameOf(BuzzWithout without);

struct BuzzCase {
  std::string law = "auto";  ///< of kProxyLawChoices
  double distance_m = 1;
  BuzzHand hand = BuzzHand::still;
  BuzzScene scene = BuzzScene::still;
  BuzzWithout without = BuzzWithout::nothing;
  std::uint32_t seed = 1;
};

/// What a person feels as vibration: from 60 to 500 Hz.
inline constexpr double kBuzzLow_hz = 60;
inline constexpr double kBuzzHigh_hz = 500;

/// The command after the whole safety chain, once contact has settled.
struct BuzzResult {
  double rms_n = 0;         ///< within the band, of all three directions together
  double line_n = 0;        ///< amplitude of the largest sine there
  double line_hz = 0;       ///< its frequency
  double mean_force_n = 0;  ///< mean magnitude, which shows that there was contact
};

/// A simulated device of 45 g with friction of 0.05 N and an encoder with steps of 50 um, held by a hand
/// (200 N/m, 4 N s/m) whose target is behind a plane with the harsher noise, so that contact is 4 mm deep, 1
/// to 7 mm where the plane breathes: the force never reaches the limit, which would hide what it does. The
/// device moves freely along the normal; along the surface the hand leads it. 1 kHz, 30 frames per
/// second.
BuzzResult runBuzz(const BuzzCase& buzz);

}  // namespace hapticd::tools
