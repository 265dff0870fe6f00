// SPDX-License-Identifier: Apache-2.0
// hapticctl-trace: the commands of hapticctl that work on files of traces.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "config/settings/settings.h"
#include "daemon/trace/mcap/trace_file.h"
#include "tools/hapticctl/base/command_line.h"
#include "tools/hapticctl/trace_files.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/options/option_checks.h"
#include "tools/lib/ros/ros_name.h"

namespace hapticd::tools {
namespace {

namespace fs = std::filesystem;

constexpr double kMaxTrace_s = 1e9;  // nanoseconds of it fit into 64 bits

/// The daemon's folder of traces; the default one if it does not report it.
fs::path traceFolder(const CommandOptions& options) {
  const auto reply = callOnce(options, {"io.hapticd.Status.ListTraces"});
  const Json* folder = reply ? fieldAt(*reply, "folder") : nullptr;
  if (folder && folder->is_string()) return folder->get<std::string>();
  return fs::path(config::StateSettings().folder) / "traces";
}

/// The file of a trace that is given by its path or by its name in the daemon's folder, finished or not.
fs::path traceFile(const CommandOptions& options, const std::string& text) {
  std::error_code ignored;
  if (text.find('/') != std::string::npos || fs::exists(text, ignored)) return text;
  const fs::path folder = traceFolder(options);
  if (fs::exists(folder / text, ignored)) return folder / text;  // with its ending
  const fs::path file = folder / (text + ".mcap");
  const fs::path open = trace::partOf(file);
  return !fs::exists(file, ignored) && fs::exists(open, ignored) ? open : file;
}

/// Adds a command that works on the file of one trace.
CLI::App& addForFile(CommandLine& line, const char* path, std::function<int(const fs::path&)> action) {
  const CommandOptions& options = line.options();
  const auto file = std::make_shared<std::string>();
  CLI::App& command = line.addHelped(
      path, [&options, file, action = std::move(action)] { return action(traceFile(options, *file)); });
  command.add_option("TRACE", *file, "Name of a trace in the daemon's folder, or a path")
      ->type_name("NAME|FILE")
      ->required();
  return command;
}

void addTimes(CLI::App& command, trace::TraceSelection& selection) {
  command.add_option("--from", selection.from_s, "Begin this many seconds after the first tick")
      ->type_name("S")
      ->check(within(0.0, kMaxTrace_s));
  command.add_option("--to", selection.to_s, "End this many seconds after the first tick")
      ->type_name("S")
      ->check(within(0.0, kMaxTrace_s));
}

void addCommands(CommandLine& line) {
  const CommandOptions& options = line.options();
  addForFile(line, "trace info", [&options](const fs::path& file) { return runTraceInfo(options, file); });

  addForFile(line, "trace breaches",
             [&options](const fs::path& file) { return runTraceBreaches(options, file); });

  const auto requested = std::make_shared<ExportOptions>();
  CLI::App& exported = addForFile(line, "trace export", [&options, requested](const fs::path& file) {
    return runTraceExport(options, file, *requested);
  });
  exported
      .add_option("--format", requested->format,
                  "csv (default); recording: the depth as a folder that camera.driver recorded plays, in\n"
                  "libfreenect's format if it is of a Kinect v1; rosbag2: a bag of ROS 2 with the topics of\n"
                  "hapticd-ros, and depth where the trace holds it")
      ->type_name("FORMAT")
      ->check(CLI::IsMember({"csv", "recording", "rosbag2"}));
  exported
      .add_option("--channel", requested->channel,
                  "What a CSV file holds: ticks (default), models, directives, events")
      ->type_name("CHANNEL")
      ->check(CLI::IsMember({"ticks", "models", "directives", "events"}));
  exported
      .add_option("--out", requested->out,
                  "The .csv, folder or .mcap of a bag to write (default: the name of the trace, in this "
                  "folder); the\n"
                  "settings are written beside a CSV file")
      ->type_name("FILE");
  exported
      .add_option("--namespace", requested->name_space,
                  "Namespace of the topics and frames of a bag (default: hapticd)")
      ->type_name("NAME")
      ->transform(CLI::Validator(ros::namespaceProblem, ""));
  addForce(exported, requested->if_exists);
  exported
      .add_option("--rows", requested->selection.most_ticks,
                  "Export at most this many ticks; all peaks of the force are kept")
      ->type_name("N")
      ->check(within(2, 1'000'000'000));
  addTimes(exported, requested->selection);

  const auto recovered_out = std::make_shared<std::string>();
  CLI::App& recovered = addForFile(line, "trace recover", [&options, recovered_out](const fs::path& file) {
    return runTraceRecover(options, file, *recovered_out);
  });
  recovered
      .add_option(
          "--out", *recovered_out,
          "The file to write, which must not exist (default: the name with -recovered, beside the trace)")
      ->type_name("FILE");

  const auto plot = std::make_shared<PlotOptions>();
  CLI::App& plotted = addForFile(line, "trace plot", [&options, plot](const fs::path& file) {
    return runTracePlot(options, file, *plot);
  });
  CLI::Option* const out =
      plotted
          .add_option("--out", plot->out,
                      "The .png, .svg or .pdf to write (default: the name of the trace, in this folder)")
          ->type_name("FILE");
  plotted
      .add_option("--format", plot->format, "png, svg or pdf (17 cm wide), in the file of the default name")
      ->type_name("FORMAT")
      ->check(CLI::IsMember({"png", "svg", "pdf"}))
      ->excludes(out);
  addForce(plotted, plot->if_exists);
  addTimes(plotted, plot->selection);
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::tools::runCommandLine(argc, argv, /*is_helper=*/true, hapticd::tools::addCommands);
}
