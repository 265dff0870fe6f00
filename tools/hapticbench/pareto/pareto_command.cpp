// SPDX-License-Identifier: Apache-2.0
#include <sysexits.h>

#include <memory>
#include <string>

#include "rt/realtime_thread.h"
#include "tools/hapticbench/pareto/laws_table.h"
#include "tools/hapticbench/pareto/pareto_report.h"
#include "tools/hapticbench/study_command.h"
#include "tools/lib/options/output_file.h"

namespace hapticd::tools {
namespace {

struct Chosen {
  ParetoOptions options;
  std::string plot_file, markdown_file, surface_table_file, laws_table_file;
  int cpu = -1;
};

void useQuickOptions(ParetoOptions& options) {
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

int runPareto(const Chosen& chosen, const StudyCommand& command) {
  const int cpu = rt::pinToCpu(chosen.cpu);
  const auto result = measurePareto(chosen.options, showProgress);
  if (!result) return fail(result.error(), EX_NOINPUT);
  if (const int status = command.report(paretoText(*result, cpu), paretoJson(*result, cpu)); status != EX_OK)
    return status;
  if (!chosen.plot_file.empty()) {
    if (const auto plotted = plotPareto(*result, chosen.plot_file); !plotted)
      return fail(plotted.error(), EX_CANTCREAT);
  }
  if (const int status = writeReport(chosen.markdown_file, paretoMarkdown(*result)); status != EX_OK)
    return status;
  if (const int status = writeReport(chosen.surface_table_file, surfaceErrorMarkdown(*result));
      status != EX_OK)
    return status;
  return writeReport(chosen.laws_table_file, lawsTable(result->laws, "tools/figures"));
}

}  // namespace

StudyCommand paretoCommand(CLI::App& app) {
  const auto chosen = std::make_shared<Chosen>();
  StudyCommand command(app, "pareto", "CPU time against force error, every law and setting as one point");
  const auto file = [&command](const char* option, std::string& name, const char* what) {
    return command->add_option(option, name, what)->type_name("FILE");
  };
  command.quick("short motions, one run, the default settings only",
                [chosen] { useQuickOptions(chosen->options); });
  command->add_option("--cpu", chosen->cpu, "CPU to run on (the last one)")->check(within(-1, 1023));
  command.recordings(chosen->options.recordings);
  command.json();
  file("--plot", chosen->plot_file, "draw the points there with gnuplot, .svg or .png")
      ->check(endsIn(".svg", ".png"));
  file("--markdown", chosen->markdown_file, "write all tables there as Markdown")->check(endsIn(".md"));
  file("--surface-table", chosen->surface_table_file,
       "write the error of the law surface by distance there, one table as Markdown")
      ->check(endsIn(".md"));
  file("--laws-table", chosen->laws_table_file,
       "write the table that `auto` chooses by (config/measured_laws.inc)")
      ->check(endsIn(".inc"));
  command.onRun([chosen](const StudyCommand& self) { return runPareto(*chosen, self); });
  return command;
}

}  // namespace hapticd::tools
