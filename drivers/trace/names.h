// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string_view>
#include <type_traits>

#include "drivers/trace/records.h"
#include "rt/depth_frame_header.h"
#include "rt/force_law.h"
#include "rt/handle_channel.h"
#include "rt/loop_state.h"

namespace hapticd::drivers {

/// Names of the enumerators in the order of their values.
template <typename Enumeration>
inline constexpr std::array<std::string_view, 0> kNames{};

template <>
inline constexpr std::array<std::string_view, rt::kModeCount> kNames<rt::Mode>{"starting", "idle", "engaged",
                                                                               "holding", "faulted"};
template <>
inline constexpr std::array<std::string_view, rt::kCauseCount> kNames<rt::Cause>{"none",
                                                                                 "requested",
                                                                                 "no_scene",
                                                                                 "depth_stale",
                                                                                 "handle_stale",
                                                                                 "handle_invalid",
                                                                                 "force_not_finite",
                                                                                 "handle_too_fast",
                                                                                 "handle_clutched",
                                                                                 "handle_not_calibrated",
                                                                                 "handle_replaced",
                                                                                 "outside_workspace",
                                                                                 "inside_surface",
                                                                                 "overrun_burst",
                                                                                 "surface_too_near"};
template <>
inline constexpr std::array<std::string_view, 4> kNames<rt::ForceLaw>{"nearest_springs", "smooth_springs",
                                                                      "proxy", "surface"};
template <>
inline constexpr std::array<std::string_view, 4> kNames<rt::ContactState>{"free", "contact", "entrenched",
                                                                          "behind"};
template <>
inline constexpr std::array<std::string_view, 3> kNames<rt::StiffnessRule>{"none", "delay", "mass"};
template <>
inline constexpr std::array<std::string_view, 3> kNames<rt::HandleCondition>{"ready", "clutched",
                                                                             "not_calibrated"};
template <>
inline constexpr std::array<std::string_view, 1> kNames<rt::DepthRawType>{"uint16"};
template <>
inline constexpr std::array<std::string_view, 2> kNames<rt::DepthLawKind>{"reciprocal", "linear"};
template <>
inline constexpr std::array<std::string_view, 2> kNames<rt::DepthNoiseKind>{"unknown", "polynomial"};
template <>
inline constexpr std::array<std::string_view, 2> kNames<DepthEncoding>{"plain", "above_zstd"};

/// Enumerations used in traces, stored as unsigned bytes.
template <typename Type>
concept NamedEnumeration = std::is_enum_v<Type> && !kNames<Type>.empty();

}  // namespace hapticd::drivers
