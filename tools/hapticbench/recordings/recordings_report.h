// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "tools/hapticbench/recordings/recordings_study.h"

namespace hapticd::tools {

/// The tables for people.
std::string recordingsTable(std::span<const SessionResult> sessions, const RecordingsOptions& options);

/// The same for programs, as JSON.
std::string recordingsJson(std::span<const SessionResult> sessions, const RecordingsOptions& options);

}  // namespace hapticd::tools
