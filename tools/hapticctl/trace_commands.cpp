// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "config/settings.h"
#include "drivers/trace/trace_file.h"
#include "tools/client/reply_reader.h"
#include "tools/hapticctl/command_line.h"
#include "tools/hapticctl/error_text.h"
#include "tools/hapticctl/events.h"
#include "tools/hapticctl/status_text.h"
#include "tools/hapticctl/trace_file_commands.h"
#include "tools/options/within.h"

namespace hapticd::tools {
namespace {

namespace fs = std::filesystem;

/// A disk may take its time over the end of a file.
constexpr std::chrono::seconds kDiskLimit{15};
constexpr double kLongestTrace_s = 1e9;  // nanoseconds of it fit into 64 bits

std::string tracesText(const Json& reply) {
  std::string text;
  for (const Json& trace : listAt(reply, "traces")) {
    const bool begin_known = fieldAt(trace, "beginNs") != nullptr;  // not to an older hapticd
    text += fmt::format("{}  {:>9}  {}{}{}{}\n", utcTime(numberAt(trace, begin_known ? "beginNs" : "timeNs")),
                        bytesText(numberAt(trace, "bytes")), textAt(trace, "name"),
                        flagAt(trace, "open") ? ", being written" : "",
                        flagAt(trace, "depth") ? ", with depth" : "", flagAt(trace, "kept") ? ", kept" : "");
  }
  return text.empty() ? fmt::format("there are none in {}\n", textAt(reply, "folder")) : text;
}

/// Where the daemon keeps its traces; the default place where it does not say.
fs::path traceFolder(const CommandOptions& options) {
  const auto reply = callOnce(options, {"io.hapticd.Status.ListTraces"});
  const Json* folder = reply ? fieldAt(*reply, "folder") : nullptr;
  if (folder && folder->is_string()) return folder->get<std::string>();
  return fs::path(config::StateSettings().folder) / "traces";
}

/// A path as it is; a name that is none as the daemon's trace of that name, finished or not.
fs::path traceFile(const CommandOptions& options, const std::string& text) {
  std::error_code ignored;
  if (text.find('/') != std::string::npos || fs::exists(text, ignored)) return text;
  const fs::path file = traceFolder(options) / (text.ends_with(".mcap") ? text : text + ".mcap");
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
  start.add_option("--label", *label, "Part of the trace's name, to know it again")->type_name("LABEL");
  start.add_flag("--depth", *depth, "Record the raw depth in it too, for haptic-replay");

  const auto finish = [&](const char* name, const char* help, const char* method, const char* done) {
    line.add(group, name, help, [&options, method, done] {
      return callAndPrint(options, {method, Json::object(), true, kDiskLimit}, [&](const Json& reply) {
        return fmt::format("{} {}\n", done, textAt(reply, "name"));
      });
    });
  };
  finish("stop", "End the trace that is written", "io.hapticd.Control.StopTrace", "finished");
  finish("dump", "Write out the last seconds that the flight recorder holds", "io.hapticd.Control.DumpTrace",
         "wrote");
}

void addFolder(CommandLine& line, CLI::App& group) {
  const CommandOptions& options = line.options();
  const auto names_only = std::make_shared<bool>(false);
  CLI::App& list = line.add(
      group, "list", "List the traces by their begin in UTC, the oldest first", [&options, names_only] {
        return callAndPrint(options, {"io.hapticd.Status.ListTraces"}, [&](const Json& reply) {
          return *names_only ? namesText(reply, "traces") : tracesText(reply);
        });
      });
  addNames(list, *names_only);
  const auto name = std::make_shared<std::string>();
  line.add(group, "delete", "Delete a finished trace, and a depth recording of older versions beside it",
           [&options, name] {
             const Call call{"io.hapticd.Control.DeleteTrace", {{"name", *name}}, true, kDiskLimit};
             return callAndPrint(options, call,
                                 [&](const Json&) { return "deleted " + printable(*name) + "\n"; });
           })
      .add_option("NAME", *name, "Name of the trace")
      ->type_name("TRACE")
      ->required();
}

void addKeep(CommandLine& line, CLI::App& group) {
  const CommandOptions& options = line.options();
  const auto name = std::make_shared<std::string>();
  const auto undo = std::make_shared<bool>(false);
  CLI::App& keep =
      line.add(group, "keep", "Mark a trace, so that nothing deletes it", [&options, name, undo] {
        const Json parameters{{"name", *name}, {"keep", !*undo}};
        return callAndPrint(
            options, {"io.hapticd.Control.KeepTrace", parameters, true, kDiskLimit}, [&](const Json&) {
              return fmt::format("{} {}\n", *undo ? "no mark any more:" : "keeps", printable(*name));
            });
      });
  keep.add_option("NAME", *name, "Name of the trace")->type_name("TRACE")->required();
  keep.add_flag("--undo", *undo, "Take the mark away");
}

/// A subcommand for one trace file.
CLI::App& addForFile(CommandLine& line, CLI::App& group, const char* name, const char* help,
                     std::function<int(const fs::path&)> action) {
  const CommandOptions& options = line.options();
  const auto file = std::make_shared<std::string>();
  CLI::App& command = line.add(group, name, help, [&options, file, action = std::move(action)] {
    return action(traceFile(options, *file));
  });
  command.add_option("TRACE", *file, "Its name in the daemon's folder, or a path")
      ->type_name("NAME|FILE")
      ->required();
  return command;
}

void addTimes(CLI::App& command, TraceSelection& selection) {
  command.add_option("--from", selection.from_s, "Begin so many seconds after the first tick")
      ->type_name("S")
      ->check(within(0.0, kLongestTrace_s));
  command.add_option("--to", selection.to_s, "End so many seconds after the first tick")
      ->type_name("S")
      ->check(within(0.0, kLongestTrace_s));
}

void addFiles(CommandLine& line, CLI::App& group) {
  const CommandOptions& options = line.options();
  addForFile(line, group, "info", "Check a trace and show what is in it",
             [&options](const fs::path& file) { return runTraceInfo(options, file); });

  const auto wanted = std::make_shared<ExportOptions>();
  CLI::App& exported =
      addForFile(line, group, "export", "Write a trace in a form that other programs read",
                 [&options, wanted](const fs::path& file) { return runTraceExport(options, file, *wanted); });
  exported
      .add_option("--format", wanted->format,
                  "csv, hdf5, or libfreenect: the depth as a folder that fakenect plays (default: what the\n"
                  "ending of --out says, else csv)")
      ->type_name("FORMAT")
      ->check(CLI::IsMember({"csv", "hdf5", "libfreenect"}));
  exported
      .add_option("--channel", wanted->channel,
                  "What a CSV holds: ticks (default), models, directives, events")
      ->type_name("CHANNEL")
      ->check(CLI::IsMember({"ticks", "models", "directives", "events"}));
  exported
      .add_option("--out", wanted->out,
                  "The .csv, .h5, .hdf5 or folder to write (default: the trace's name here); beside a CSV "
                  "its settings")
      ->type_name("FILE");
  addForce(exported, wanted->if_exists);
  exported
      .add_option("--rows", wanted->selection.most_ticks,
                  "At most that many ticks; all peaks of the force are kept")
      ->type_name("N")
      ->check(within(2, 1'000'000'000));
  addTimes(exported, wanted->selection);

  const auto recovered_out = std::make_shared<std::string>();
  CLI::App& recovered = addForFile(line, group, "recover",
                                   "Save what is whole of a trace that is damaged or cut off into a new file",
                                   [&options, recovered_out](const fs::path& file) {
                                     return runTraceRecover(options, file, *recovered_out);
                                   });
  recovered
      .add_option(
          "--out", *recovered_out,
          "The file to write, which must not exist (default: the trace's name with -recovered, beside it)")
      ->type_name("FILE");

  const auto plot = std::make_shared<PlotOptions>();
  CLI::App& plotted =
      addForFile(line, group, "plot", "Draw force, penetration and lateness of a trace with gnuplot",
                 [&options, plot](const fs::path& file) { return runTracePlot(options, file, *plot); });
  plotted.add_option("--out", plot->out, "The .png or .svg to write (default: the trace's name here)")
      ->type_name("FILE");
  addForce(plotted, plot->if_exists);
  addTimes(plotted, plot->selection);
}

}  // namespace

void addTraceCommands(CommandLine& line) {
  CLI::App& group = line.addGroup("trace", "Record what the force loop does, and work with the recordings");
  addRecording(line, group);
  addFolder(line, group);
  addKeep(line, group);
  addFiles(line, group);
}

}  // namespace hapticd::tools
