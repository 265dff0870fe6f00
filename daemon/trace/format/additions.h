// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "config/settings/fixture_settings.h"
#include "daemon/trace/format/records.h"
#include "rt/fixtures/fixture.h"
#include "rt/tissue/tissue.h"

namespace hapticd::trace {

/// Describes fixtures and tissue regions as a record. `fixtures` and `tissue` are what the force loop gets of
/// `additions`.
AdditionsRecord recordOf(const config::SceneAdditions& additions, const rt::FixtureSet& fixtures,
                         const rt::TissueMap& tissue, const config::SolidTable& solids, double tool_radius_m,
                         std::int64_t time_ns);

/// The name of a solid among the files of a trace.
std::string attachmentNameOf(const config::Solid& solid);
/// The solids among the files of a trace. `name`: of the trace.  Errors: one is damaged.
base::Result<config::SolidTable> solidsIn(const std::vector<TraceAttachment>& attachments,
                                          const std::string& name);

/// Describes a pose as a record, and makes the pose of a record. `time_ns`: when it was handed to the force
/// loop.
PoseRecord recordOf(const rt::FramePose& pose, std::int64_t time_ns);
rt::FramePose poseOf(const PoseRecord& record);

// Make `fixtures` or `tissue` what it was when it was recorded, with its generation and all numbers that the
// force loop knows its parts by. `T_world_camera`: the camera's pose in that session. `solids`: those that
// the record refers to; they must outlive the set. Errors: a record that this version cannot read; `where` is
// `name`.
base::Result<void> restore(const AdditionsRecord& record, const rt::PoseParameters& T_world_camera,
                           const std::string& name, const config::SolidTable& solids,
                           rt::FixtureSet& fixtures);
base::Result<void> restore(const AdditionsRecord& record, const rt::PoseParameters& T_world_camera,
                           const std::string& name, rt::TissueMap& tissue);

}  // namespace hapticd::trace
