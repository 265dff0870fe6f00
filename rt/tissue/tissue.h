// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "rt/base/parameters.h"
#include "rt/base/words.h"
#include "rt/channels/triple_buffer.h"
#include "rt/depth/depth_frame.h"
#include "rt/fixtures/shape.h"

/// The stiffness map as the force loop reads it: regions of the scene whose contact differs from the rest.
namespace hapticd::rt {

/// How the force in contact depends on the depth d of the HIP below the surface and on its rate d'.
enum class ContactModel : std::uint8_t {
  linear,         ///< K d + B d'
  hunt_crossley,  ///< K d^n (1 + a d'), Hunt and Crossley 1975; K in N/m^n
  layered,        ///< K d down to layer_m, lower_stiffness_n_per_m below it
};
constexpr auto wordsOf(ContactModel) {
  return words<ContactModel>("linear", "hunt_crossley", "layered");
}

/// Where a region is.
enum class TissuePlace : std::uint8_t {
  shape,  ///< inside a shape in space
  label,  ///< where the label image has the region's label
};

inline constexpr std::size_t kMaxTissueRegions = 32;

/// One region. Where regions overlap, the later one of the map covers the earlier one.
struct TissueRegion {
  std::uint32_t identity = 0;  ///< of the region; stays the same when its values change
  TissuePlace place = TissuePlace::shape;
  Shape shape;             ///< sphere, box or capsule
  std::uint8_t label = 0;  ///< 1..255
  /// Width over which the contact passes to that of the surroundings, half of it inside; > 0. For labels it
  /// is measured on the surface.
  double transition_m = 0.01;
  ContactModel model = ContactModel::linear;
  double stiffness_n_per_m = 500;        ///< hunt_crossley: at a depth of kReferenceDepth_m; > 0
  double exponent = 1.5;                 ///< hunt_crossley: n, 1..2
  double damping_per_speed_s_per_m = 0;  ///< hunt_crossley: a, >= 0
  double lower_stiffness_n_per_m = 0;    ///< layered: > 0
  double layer_m = 0.005;                ///< layered: > 0
  double damping_n_s_per_m = 0;          ///< linear, layered: B, >= 0
  double friction = 0;                   ///< Coulomb's coefficient
  double cue_force_n = 0;                ///< amplitude of the palpation cue; 0: none
  double cue_hz = 22.3;                  ///< its frequency, 1..250
};

/// Depth at which a Hunt-Crossley contact has the stated secant stiffness: K = stiffness d_ref^(1 - n).
inline constexpr double kReferenceDepth_m = 0.005;

/// The whole map. Large (about 1 MB): passed by reference only.
struct TissueMap {
  std::uint64_t generation = 0;  ///< incremented with each change
  std::uint32_t count = 0;
  std::array<TissueRegion, kMaxTissueRegions> regions{};
  bool has_labels = false;
  int label_width_px = 0;   ///< size of the depth image that the labels belong to, at most kMaxFrameWidth
  int label_height_px = 0;  ///< at most kMaxFrameHeight
  /// For each pixel of the depth image, row by row; 0: no region.
  std::array<std::uint8_t, kMaxFramePixels> labels{};

  /// Returns the labels in use: label_height_px rows of label_width_px.  RT: safe.
  std::span<const std::uint8_t> usedLabels() const noexcept {
    return {labels.data(),
            static_cast<std::size_t>(label_width_px) * static_cast<std::size_t>(label_height_px)};
  }
  /// Returns whether there are labels that fit the frames of a camera; others have no effect.  RT: safe.
  bool hasLabelsFor(const DepthModelParameters& camera) const noexcept {
    return has_labels && label_width_px == camera.width_px && label_height_px == camera.height_px;
  }
};
static_assert(std::is_trivially_copyable_v<TissueMap>);

/// Written by the control thread, read by the force thread.
using TissueChannel = TripleBuffer<TissueMap>;

}  // namespace hapticd::rt
