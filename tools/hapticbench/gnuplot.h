#pragma once

#include <filesystem>
#include <string>

#include "config/error.h"

namespace hapticd::tools {

/// `text` as gnuplot reads it between single quotes.
std::string gnuplotQuoted(const std::string& text);

/// Runs gnuplot on `script`, which writes `image`. A file beside the image holds the script meanwhile.
/// Errors: gnuplot is not installed, refuses the script or leaves no image; `remedy` ends the message.
config::Result<void> runGnuplot(const std::string& script, const std::filesystem::path& image,
                                const std::string& remedy);

}  // namespace hapticd::tools
