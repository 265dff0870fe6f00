// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "config/settings.h"
#include "drivers/trace/trace_file.h"
#include "tools/hapticctl/command_line.h"
#include "tools/hapticctl/error_text.h"
#include "tools/hapticctl/trace_file_commands.h"
#include "tools/hapticctl/trace_folder_commands.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/options/within.h"

namespace hapticd::tools {
namespace {

namespace fs = std::filesystem;

constexpr double kLongestTrace_s = 1e9;  // nanoseconds of it fit into 64 bits

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
  const fs::path open = drivers::partOf(file);
  return !fs::exists(file, ignored) && fs::exists(open, ignored) ? open : file;
}

void addRecording(CommandLine& line, CLI::App& group) {
  const CommandOptions& options = line.options();
  const auto label = std::make_shared<std::string>();
  const auto depth = std::make_shared<bool>(false);
  CLI::App& start =
      line.add(group, "start", "Write all ticks into a trace from now on", [&options, label, depth] {
        Json parameters = Json::object();
        if (!label->empty()) parameters["label"] = *label;
        if (*depth) parameters["depth"] = true;
        return callAndPrint(options, {"io.hapticd.Control.StartTrace", parameters, true, kDiskLimit},
                            [](const Json& reply) { return "writing " + textAt(reply, "name") + "\n"; });
      });
  start.add_option("--label", *label, "A label that becomes part of the name of the trace")
      ->type_name("LABEL");
  start.add_flag("--depth", *depth, "Also record the raw depth, for haptic-replay");

  const auto finish = [&](const char* name, const char* help, const char* method, const char* done) {
    line.add(group, name, help, [&options, method, done] {
      return callAndPrint(options, {method, Json::object(), true, kDiskLimit}, [&](const Json& reply) {
        return fmt::format("{} {}\n", done, textAt(reply, "name"));
      });
    });
  };
  finish("stop", "Finish the trace that is being written", "io.hapticd.Control.StopTrace", "finished");
  finish("dump", "Write the last seconds, which the flight recorder holds, into a trace",
         "io.hapticd.Control.DumpTrace", "wrote");
}

void addMark(CommandLine& line, CLI::App& group) {
  const CommandOptions& options = line.options();
  const auto text = std::make_shared<std::string>();
  line.add(group, "mark", "Put a mark of the experimenter into the trace that is being written",
           [&options, text] {
             return callAndPrint(
                 options, {"io.hapticd.Control.MarkTrace", {{"text", *text}}, true}, [&](const Json& reply) {
                   return fmt::format("marked {}: {}\n", textAt(reply, "name"), printable(*text));
                 });
           })
      .add_option("TEXT", *text, "Text of the mark, at most 200 bytes; the plot shows it")
      ->type_name("TEXT")
      ->required();
}

/// Adds a command that works on the file of one trace.
CLI::App& addForFile(CommandLine& line, CLI::App& group, const char* name, const char* help,
                     std::function<int(const fs::path&)> action) {
  const CommandOptions& options = line.options();
  const auto file = std::make_shared<std::string>();
  CLI::App& command = line.add(group, name, help, [&options, file, action = std::move(action)] {
    return action(traceFile(options, *file));
  });
  command.add_option("TRACE", *file, "Name of a trace in the daemon's folder, or a path")
      ->type_name("NAME|FILE")
      ->required();
  return command;
}

void addTimes(CLI::App& command, TraceSelection& selection) {
  command.add_option("--from", selection.from_s, "Begin that many seconds after the first tick")
      ->type_name("S")
      ->check(within(0.0, kLongestTrace_s));
  command.add_option("--to", selection.to_s, "End that many seconds after the first tick")
      ->type_name("S")
      ->check(within(0.0, kLongestTrace_s));
}

void addFiles(CommandLine& line, CLI::App& group) {
  const CommandOptions& options = line.options();
  addForFile(line, group, "info", "Check a trace and show what it contains",
             [&options](const fs::path& file) { return runTraceInfo(options, file); });

  const auto requested = std::make_shared<ExportOptions>();
  CLI::App& exported = addForFile(
      line, group, "export", "Write a trace in a format that other programs read",
      [&options, requested](const fs::path& file) { return runTraceExport(options, file, *requested); });
  exported
      .add_option("--format", requested->format,
                  "csv (default), or recording: the depth as a folder that camera.driver recorded plays, in\n"
                  "libfreenect's format if it is of a Kinect v1")
      ->type_name("FORMAT")
      ->check(CLI::IsMember({"csv", "recording"}));
  exported
      .add_option("--channel", requested->channel,
                  "What a CSV file holds: ticks (default), models, directives, events")
      ->type_name("CHANNEL")
      ->check(CLI::IsMember({"ticks", "models", "directives", "events"}));
  exported
      .add_option(
          "--out", requested->out,
          "The .csv or folder to write (default: the name of the trace, in this folder); the settings are\n"
          "written beside a CSV file")
      ->type_name("FILE");
  addForce(exported, requested->if_exists);
  exported
      .add_option("--rows", requested->selection.most_ticks,
                  "Export at most that many ticks; all peaks of the force are kept")
      ->type_name("N")
      ->check(within(2, 1'000'000'000));
  addTimes(exported, requested->selection);

  const auto recovered_out = std::make_shared<std::string>();
  CLI::App& recovered = addForFile(line, group, "recover",
                                   "Save the intact parts of a damaged or cut off trace into a new file",
                                   [&options, recovered_out](const fs::path& file) {
                                     return runTraceRecover(options, file, *recovered_out);
                                   });
  recovered
      .add_option(
          "--out", *recovered_out,
          "The file to write, which must not exist (default: the name with -recovered, beside the trace)")
      ->type_name("FILE");

  const auto plot = std::make_shared<PlotOptions>();
  CLI::App& plotted = addForFile(
      line, group, "plot", "Draw forces, penetration, modes, events and latency of a trace with gnuplot",
      [&options, plot](const fs::path& file) { return runTracePlot(options, file, *plot); });
  plotted
      .add_option("--out", plot->out,
                  "The .png or .svg to write (default: the name of the trace, in this folder)")
      ->type_name("FILE");
  addForce(plotted, plot->if_exists);
  addTimes(plotted, plot->selection);
}

}  // namespace

void addTraceCommands(CommandLine& line) {
  CLI::App& group = line.addGroup("trace", "Record the force loop, and work with the recordings");
  addRecording(line, group);
  addMark(line, group);
  addTraceFolderCommands(line, group);
  addFiles(line, group);
}

}  // namespace hapticd::tools
