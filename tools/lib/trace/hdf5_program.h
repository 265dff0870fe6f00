// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "config/error.h"
#include "tools/lib/trace/trace_selection.h"
#include "tools/lib/whole_file/whole_file.h"

namespace hapticd::tools {

/// Runs exportHdf5() in a separate program, haptic-hdf5 of the package hapticd-tools, so that a box needs no
/// libhdf5. The program is looked for beside this one and in ../libexec/hapticd. Errors: those of
/// exportHdf5(), and that the program is not installed or ended without a result. Thread: any.  RT: not safe.
config::Result<std::uint64_t> exportHdf5ByProgram(const std::filesystem::path& trace,
                                                  const std::filesystem::path& hdf5,
                                                  const TraceSelection& selection = {},
                                                  const Progress& progress = {},
                                                  IfExists if_exists = IfExists::refuse);

}  // namespace hapticd::tools
