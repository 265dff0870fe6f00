// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "config/settings/law_choice.h"
#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "rt/base/words.h"
#include "rt/depth/depth_frame.h"
#include "rt/laws/law_table.h"
#include "rt/loop/loop_state.h"
#include "tools/lib/offline/offline_box.h"
#include "tools/lib/parts/fields.h"

namespace hapticd::tools {

using config::nameOf;

/// What an option calls an enumerator; and all of them, in their order.
template <rt::Worded Enumeration>
constexpr std::string_view nameOf(Enumeration value) {
  return rt::wordOf(value);
}
template <rt::Worded Enumeration>
inline constexpr auto kAllOf = [] {
  std::array<Enumeration, rt::kWords<Enumeration>.size()> all{};
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<Enumeration>(i);
  return all;
}();
/// The same for options that are all of them.
template <rt::Worded Enumeration>
std::vector<Enumeration> everyOne() {
  return {kAllOf<Enumeration>.begin(), kAllOf<Enumeration>.end()};
}

/// The laws as the studies run them: bare, with a setting, or as shipped.

/// A force law and what of its settings changes its cost or its error. Ordered by its members in turn.
struct LawSetting {
  rt::ForceLaw law{};
  bool filtered = false;  ///< by config::filterOfChoice(); only the laws on points
  int fusion_frames = rt::SurfaceParameters{}.fusion_frames;  ///< of the laws on the surface

  /// Its force depends on frames before the newest one.
  bool usesEarlierFrames() const { return filtered || (rt::rowOf(law).reads_surface && fusion_frames > 1); }
  friend auto operator<=>(const LawSetting&, const LawSetting&) = default;
};
auto fieldsOf(Is<LawSetting> auto& setting) {
  auto& [law, filtered, fusion_frames] = setting;
  return std::tie(law, filtered, fusion_frames);
}

/// Returns the name of the law and of its settings that differ from the shipped ones.
std::string nameOf(const LawSetting& setting);

/// The laws on points, filtered or not, and `surface` as shipped.
std::vector<LawSetting> shippedSettings();

/// A box that computes with that setting and whose safety chain limits nothing.
std::unique_ptr<OfflineBox> boxFor(const LawSetting& setting, const rt::DepthModelParameters& camera);

/// The words of the laws that are `included`, and of the choice among them.
template <typename Included>
std::vector<std::string> lawChoices(Included included) {
  std::vector<std::string> words;
  for (const rt::ForceLawRow& law : rt::kForceLaws) {
    if (included(law)) words.emplace_back(rt::wordOf(law.law));
  }
  words.emplace_back(config::kAutomaticLaw);
  return words;
}

/// The words of force.law: all, and those whose force is a spring to a proxy.
inline const std::vector<std::string> kLawChoices = lawChoices([](const rt::ForceLawRow&) { return true; });
inline const std::vector<std::string> kProxyLawChoices =
    lawChoices([](const rt::ForceLawRow& law) { return law.has_proxy; });

/// Returns the parameters in effect under `force.law: choice` of the shipped configuration when the surface
/// is `distance_m` from the camera.
rt::LiveParameters shippedParameters(const std::string& choice, double distance_m,
                                     const rt::DepthModelParameters& camera = {});

/// A box with these parameters, engaged at once, and a camera at the world's origin that looks along -z.
std::unique_ptr<OfflineBox> boxWith(const rt::LiveParameters& parameters,
                                    const rt::DepthModelParameters& camera);
/// A box with shippedParameters().
std::unique_ptr<OfflineBox> shippedBox(const std::string& choice, double distance_m,
                                       const rt::DepthModelParameters& camera);

/// Frames in the order of their arrival, as many as are requested.
struct FrameStream {
  /// Its arrival_ns is that of arrival_tick. Stays valid until the next but one is requested.
  std::function<const rt::DepthFrame&(int index)> frame;
  std::function<long(int index)> arrival_tick;  ///< 0 for the first, strictly increasing
};

/// The tick at which frame `index` of a camera with 30 frames per second arrives.
constexpr long tickOfRegularFrame(int index) {
  return (static_cast<long>(index) * 100 + 2) / 3;
}

/// Frames of a camera with 30 frames per second: `render` fills frame `number`, from 1 on, which shows the
/// scene at `tick`.
FrameStream renderedStream(
    const std::function<void(long tick, std::uint64_t number, rt::DepthFrame& frame)>& render);

/// Ticks of one millisecond, with each frame shown at the tick that it arrives at; ticks know its age.
/// Thread: one.  RT: not safe.
class FramePlayer {
 public:
  FramePlayer(OfflineBox& box, FrameStream stream) : box_(box), stream_(std::move(stream)) {}

  /// The next tick, with the HIP there and moving at the speed that brought it there.
  rt::Tick tick(const rt::Vec3& hip_m_in_world);

  /// The number of the next tick, from 0 on.
  long nextTick() const { return next_tick_; }
  /// The newest frame that was shown, -1 before the first.
  int frame() const { return frame_; }
  /// The last tick was the first one that could use the newest frame.
  bool frameIsNew() const { return frame_is_new_; }

 private:
  OfflineBox& box_;
  FrameStream stream_;
  long next_tick_ = 0;
  int frame_ = -1;
  bool frame_is_new_ = false;
  rt::Vec3 hip_before_;
};

}  // namespace hapticd::tools
