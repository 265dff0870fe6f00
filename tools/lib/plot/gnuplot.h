// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "config/base/error.h"

namespace hapticd::tools {

/// `text` as gnuplot reads it between single quotes.
std::string gnuplotQuoted(const std::string& text);

/// "pngcairo", "pdfcairo" or "svg", by the ending of the image.
const char* gnuplotTerminal(const std::filesystem::path& image);

/// The image that gnuplot makes of `script`, which sets a terminal and leaves the output at standard output.
/// Errors: gnuplot is not installed, refuses the script or makes nothing; `remedy` ends the message.
base::Result<std::string> drawnByGnuplot(const std::string& script, const std::string& remedy);

/// Writes that image to a file, completely or not at all; an existing file is replaced.
base::Result<void> runGnuplot(const std::string& script, const std::filesystem::path& image,
                              const std::string& remedy);

}  // namespace hapticd::tools
