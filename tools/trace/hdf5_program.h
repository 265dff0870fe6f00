// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "config/error.h"
#include "tools/trace/trace_selection.h"
#include "tools/whole_file/whole_file.h"

namespace hapticd::tools {

/// exportHdf5() in a program of its own, haptic-hdf5, which the package hapticd-tools brings: whoever only
/// runs the box needs no libhdf5. It is looked for beside this program and in ../libexec/hapticd. Errors:
/// those of exportHdf5(), and that the program is not installed or ended without an answer. Thread: any.  RT:
/// not safe.
config::Result<std::uint64_t> exportHdf5ByProgram(const std::filesystem::path& trace,
                                                  const std::filesystem::path& hdf5,
                                                  const TraceSelection& selection = {},
                                                  const Progress& progress = {},
                                                  IfExists if_exists = IfExists::refuse);

}  // namespace hapticd::tools
