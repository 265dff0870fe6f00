// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "config/base/error.h"
#include "config/settings/fixture_settings.h"
#include "daemon/trace/format/records.h"
#include "rt/fixtures/fixture.h"
#include "rt/tissue/tissue.h"

namespace hapticd::trace {

/// Describes fixtures and tissue regions as a record. `fixtures` and `tissue` are what the force loop gets of
/// `additions`.
AdditionsRecord recordOf(const config::SceneAdditions& additions, const rt::FixtureSet& fixtures,
                         const rt::TissueMap& tissue, std::int64_t time_ns);

// Make `fixtures` or `tissue` what it was when it was recorded, with its generation and all numbers that the
// force loop knows its parts by. `T_world_camera`: the camera's pose in that session.
// Errors: a record that this version cannot read; `where` is `name`.
base::Result<void> restore(const AdditionsRecord& record, const rt::PoseParameters& T_world_camera,
                           const std::string& name, rt::FixtureSet& fixtures);
base::Result<void> restore(const AdditionsRecord& record, const rt::PoseParameters& T_world_camera,
                           const std::string& name, rt::TissueMap& tissue);

}  // namespace hapticd::trace
