// SPDX-License-Identifier: Apache-2.0
// haptic-hdf5 exports a trace as HDF5 for `hapticctl trace export`, which runs it and reads its results,
// lines of JSON on stdout.

#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "config/program.h"
#include "tools/lib/options/within.h"
#include "tools/lib/trace/hdf5_export.h"

namespace hapticd::tools {
namespace {

constexpr double kLongest_s = 1e9;  // nanoseconds of it fit into 64 bits

void answer(const nlohmann::json& line) {
  fmt::print("{}\n", line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  config::flushOutput();
}

int run(int argc, char** argv) {
  CLI::App app{"haptic-hdf5: writes a trace of hapticd as HDF5, for hapticctl trace export"};
  app.set_version_flag("-V,--version", std::string("haptic-hdf5 ") + HAPTICD_VERSION);
  std::string trace;
  std::string out;
  bool replace = false;
  TraceSelection selection;
  app.add_option("--trace", trace, "the trace")->required()->type_name("FILE");
  app.add_option("--out", out, "the HDF5 file to write")->required()->type_name("FILE");
  app.add_option("--from", selection.from_s, "begin so many seconds after the first tick")
      ->check(within(0.0, kLongest_s));
  app.add_option("--to", selection.to_s, "end so many seconds after the first tick")
      ->check(within(0.0, kLongest_s));
  app.add_option("--rows", selection.most_ticks, "at most that many ticks; 0: all")
      ->check(within(std::size_t{0}, std::size_t{1'000'000'000}));
  app.add_flag("--force", replace, "replace the file if it exists");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return config::endWithoutWork(app, error, EX_USAGE);
  }

  int shown_percent = -1;
  const auto show = [&](double share) {
    const int percent = static_cast<int>(std::lround(100 * share));
    if (percent != std::exchange(shown_percent, percent)) answer({{"share", share}});
  };
  const auto rows = exportHdf5(trace, out, selection, show, replace ? IfExists::replace : IfExists::refuse);
  if (rows) {
    answer({{"rows", *rows}});
    return 0;
  }
  const config::Error& error = rows.error();
  answer({{"error", {{"where", error.where}, {"what", error.what}, {"remedy", error.remedy}}}});
  return 1;
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::config::runProgram("haptic-hdf5", [&] { return hapticd::tools::run(argc, argv); });
}
