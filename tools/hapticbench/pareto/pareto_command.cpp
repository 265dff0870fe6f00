// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/pareto_command.h"

#include <fmt/format.h>
#include <sysexits.h>
#include <unistd.h>

#include <cstdio>

#include "config/error.h"
#include "rt/realtime_thread.h"
#include "tools/hapticbench/pareto/laws_table.h"
#include "tools/hapticbench/pareto/pareto_markdown.h"
#include "tools/hapticbench/pareto/pareto_plot.h"
#include "tools/hapticbench/pareto/pareto_report.h"
#include "tools/options/output_file.h"
#include "tools/options/within.h"
#include "tools/whole_file/whole_file.h"

namespace hapticd::tools {
namespace {

int fail(const config::Error& error, int status) {
  fmt::print(stderr, "hapticbench: {}\n", error.text());
  return status;
}

int write(const std::string& file, const std::string& text) {
  const auto written = writeWholeFile(file, text, IfExists::replace);
  return written ? EX_OK : fail(written.error(), EX_CANTCREAT);
}

void progress(const std::string& what) {
  if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r{:<60}\r", what);
}

}  // namespace

ParetoCommand::ParetoCommand(CLI::App& app, const std::string& recordings)
    : command_(
          app.add_subcommand("pareto", "CPU time against force error, every law and setting as one point")),
      recordings_(recordings) {
  const auto file = [this](const char* option, std::string& name, const char* what) {
    return command_->add_option(option, name, what)->type_name("FILE");
  };
  command_->add_option("--cpu", cpu_, "CPU to be pinned to (the last one)")->check(within(-1, 1023));
  command_->add_option("--recordings", recordings_,
                       "folder of recordings ($HAPTICD_RECORDINGS, or ../shared/recordings)");
  command_->add_flag("--quick", quick_, "short motions, one run, the default settings only");
  file("--json", json_file_, "write the result there too")->check(endsIn(".json"));
  file("--plot", plot_file_, "draw it there with gnuplot, .svg or .png")->check(endsIn(".svg", ".png"));
  file("--markdown", markdown_file_, "write all tables there as Markdown")->check(endsIn(".md"));
  file("--surface-table", surface_table_file_,
       "write the error of the law surface by distance there, one table as Markdown")
      ->check(endsIn(".md"));
  file("--laws-table", laws_table_file_, "write what the choice of a law reads (config/measured_laws.inc)")
      ->check(endsIn(".inc"));
}

int ParetoCommand::report(const ParetoResult& result, int cpu) const {
  fmt::print("{}", paretoTable(result, cpu));
  if (!json_file_.empty()) {
    if (const int status = write(json_file_, paretoJson(result, cpu)); status != EX_OK) return status;
  }
  if (!plot_file_.empty()) {
    if (const auto plotted = plotPareto(result, plot_file_); !plotted)
      return fail(plotted.error(), EX_CANTCREAT);
  }
  if (!markdown_file_.empty()) {
    if (const int status = write(markdown_file_, paretoMarkdown(result)); status != EX_OK) return status;
  }
  return surface_table_file_.empty() ? EX_OK : write(surface_table_file_, surfaceErrorMarkdown(result));
}

int ParetoCommand::run() const {
  const int cpu = rt::pinToCpu(cpu_);
  ParetoOptions options;
  options.recordings = recordings_;
  if (quick_) {
    options.settings = {{},
                        {.law = rt::ForceLaw::smooth_springs},
                        {.law = rt::ForceLaw::proxy},
                        {.law = rt::ForceLaw::surface}};
    options.cost = {.seconds = 0.2, .repeats = 1, .checks = 3};
    options.laws = {.distances_m = {1}, .seconds = 0.1, .repeats = 1, .pushes = 1};
    options.distances = {.laws = {"nearest_springs", "surface"},
                         .distances_m = {1},
                         .noises = {SceneNoise::harsh},
                         .kinds = {SurfaceKind::flat},
                         .variants = 1};
    options.evaluations = 100;
    options.pushes = 1;
    options.hard_frames = false;
  }
  const auto result = measurePareto(options, progress);
  if (!result) return fail(result.error(), EX_NOINPUT);
  if (const int status = report(*result, cpu); status != EX_OK || laws_table_file_.empty()) return status;
  return write(laws_table_file_, lawsTable(result->laws, "tools/figures"));
}

}  // namespace hapticd::tools
