// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <string>
#include <string_view>

#include "config/law_choice.h"
#include "config/settings.h"
#include "rt/parameters.h"
#include "tools/offline/offline_box.h"

/// The laws whose force is a spring to a proxy, with the settings that a user who changes nothing gets.
namespace hapticd::tools {

inline constexpr std::array<config::LawChoice, 3> kShippedLaws{std::nullopt, rt::ForceLaw::surface,
                                                               rt::ForceLaw::proxy};

using config::nameOf;

/// The choice of that name; the name is one of kShippedLaws.
config::LawChoice shippedLawNamed(std::string_view name);

/// What acts under `law` when the surface is `distance_m` from the camera.
rt::LiveParameters shippedParameters(config::LawChoice law, double distance_m);

/// A box with these parameters and a camera at the world's origin that looks along -z.
std::unique_ptr<OfflineBox> shippedBox(config::LawChoice law, double distance_m,
                                       const rt::DepthModelParameters& camera);

}  // namespace hapticd::tools
