// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "config/error.h"
#include "tools/lib/trace/trace_selection.h"
#include "tools/lib/whole_file/whole_file.h"

namespace hapticd::tools {

/// Writes ticks, models, directives and events of `trace` into the HDF5 file `hdf5`: a
/// group per channel, in it one compressed dataset per column (N, or N x 3 for vectors) with the attributes
/// `unit` and, for enumerators, `names`; time_s counts from the first tick, realtime_s is UTC since 1970.
/// A field that does not apply (columns.h) is NaN or the enumerator does_not_apply. Each parameter of a
/// directive is a dataset in directives/parameters. The trace's metadata are attributes of the root, its
/// configuration those of the group settings. The file is assembled in memory first. Returns the number of
/// rows of all channels. The file is written completely or not at all. Errors: those of readTrace(), an
/// impossible selection, a file that exists and is not to be replaced or cannot be written. Thread: one at a
/// time (libhdf5). RT: not safe.
config::Result<std::uint64_t> exportHdf5(const std::filesystem::path& trace,
                                         const std::filesystem::path& hdf5,
                                         const TraceSelection& selection = {}, const Progress& progress = {},
                                         IfExists if_exists = IfExists::refuse);

}  // namespace hapticd::tools
