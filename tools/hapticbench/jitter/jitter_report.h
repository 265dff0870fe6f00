// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "tools/hapticbench/jitter/jitter_study.h"

namespace hapticd::tools {

/// Percentiles of both loops and their ratio beside the limit, for people.
std::string jitterTable(const JitterResult& result);

/// The same with all histograms, for programs.
std::string jitterJson(const JitterResult& result);

/// A script for gnuplot: for each load how many wake-ups came how late.
std::string jitterPlotScript(const JitterResult& result);

}  // namespace hapticd::tools
