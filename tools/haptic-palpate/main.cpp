// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "config/base/error.h"
#include "config/base/program.h"
#include "daemon/trace/reader/trace_reader.h"
#include "tools/haptic-palpate/palpation_map.h"
#include "tools/lib/options/option_checks.h"

namespace hapticd::tools {
namespace {

int fail(const base::Error& error, int status) {
  std::fputs(fmt::format("haptic-palpate: {}\n", error.text()).c_str(), stderr);
  return status;
}

int run(int argc, char** argv) {
  CLI::App app{
      "haptic-palpate: stiffness over the surface that was pressed in a trace, and the place that is "
      "stiffer\n"
      "than its surroundings. Uses the ticks in contact under the laws proxy and surface that are deeper "
      "than\n"
      "1 mm and move faster than 2 mm/s along the normal; the force is that of the law. K and B with their\n"
      "standard errors are those of F = K d + B d' at each place; upper and lower K those of two layers."};
  app.footer("Exit status: 0 done, 1 too little contact, 64 usage, 66 no readable trace.");
  std::string trace;
  double cell_mm = 2;
  bool json = false;
  app.add_option("TRACE", trace, "trace file")->required()->type_name("");
  app.add_option("--cell-mm", cell_mm, "edge of a place (2)")->type_name("MM")->check(within(0.5, 100.0));
  app.add_flag("--json", json, "print the result as JSON, for programs");
  app.set_version_flag("-V,--version", std::string("haptic-palpate ") + HAPTICD_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  Palpation palpation;
  const auto info = trace::readTrace(trace, {.tick = [&palpation](const rt::Tick& tick) {
                                       palpation.add(tick);
                                       return true;
                                     }});
  if (!info) return fail(info.error(), EX_NOINPUT);
  const PalpationMap map = palpation.map(1e-3 * cell_mm);
  if (map.cells.empty()) {
    return fail({trace, fmt::format("{} ticks in contact are too few", palpation.contactTicks()),
                 "press deeper than 1 mm, under the law proxy or surface"},
                EXIT_FAILURE);
  }
  std::fputs((json ? palpationJson(map) : palpationText(map)).c_str(), stdout);
  return EX_OK;
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::base::runProgram("haptic-palpate", [&] { return hapticd::tools::run(argc, argv); });
}
