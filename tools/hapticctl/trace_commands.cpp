// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "config/base/value_text.h"
#include "daemon/trace/format/trace_format.h"
#include "tools/hapticctl/base/command_line.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/hapticctl/text/list_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

/// How long calls about traces may take: a disk may need long to write the end of a file.
constexpr std::chrono::seconds kDiskLimit{15};

const Call kListTraces{"io.hapticd.Status.ListTraces"};

struct ListWords {
  TraceListOptions options;
  std::string since;
  std::string until;
  bool names_only = false;
};

struct DeleteWords {
  std::vector<std::string> names;
  std::string older_than;
  bool yes = false;
};

/// Accepts a date and time, or an age.
CLI::Validator isTime() {
  return {[](std::string& text) {
            if (timeFrom(text, realtimeNow_ns())) return std::string();
            return base::inQuotes(text) +
                   " is neither a time in UTC (2026-03-04, \"2026-03-04 05:06\") nor an age (90s, 45min, "
                   "12h, 30d, 2w)";
          },
          ""};
}

CLI::Validator isAge() {
  return {[](std::string& text) {
            if (secondsOfAge(text)) return std::string();
            return base::inQuotes(text) + " is not an age (90s, 45min, 12h, 30d, 2w)";
          },
          ""};
}

/// CLOCK_REALTIME of this computer; nothing if it does not tell the time, as far as can be known beside these
/// traces.
std::optional<std::int64_t> nowBeside(const Json& reply) {
  const trace::WallClock clock = trace::WallClock::read();
  return clock.isSet(latestBegin_ns(reply)) ? std::optional(clock.realtime_ns) : std::nullopt;
}

int runList(const CommandOptions& options, ListWords& words) {
  const std::int64_t now_ns = realtimeNow_ns();
  words.options.since_ns = words.since.empty() ? std::nullopt : timeFrom(words.since, now_ns);
  words.options.until_ns = words.until.empty() ? std::nullopt : timeFrom(words.until, now_ns);
  auto reply = callOnce(options, kListTraces);
  if (!reply) return report(reply.error(), options.json);
  const Json traces = chosenTraces(*reply, words.options);
  if (words.names_only) {
    showNames({{"traces", traces}}, "traces", options.json);
  } else if (options.json) {
    (*reply)["traces"] = traces;
    printJson(*reply);
  } else {
    fmt::print("{}", traceListText(traces, *reply, nowBeside(*reply), terminalSize().columns));
  }
  return kOk;
}

ClientResult<Json> deleteOne(const CommandOptions& options, const std::string& name) {
  return callOnce(options, {"io.hapticd.Control.DeleteTrace", {{"name", name}}, true, kDiskLimit});
}

/// Asks on the terminal; false for any answer but yes, and where there is nobody to answer.
bool isConfirmed(const std::string& question) {
  fmt::print(stderr, "{} [y/N] ", question);
  std::fflush(stderr);
  std::string answer;
  return std::getline(std::cin, answer) && (answer == "y" || answer == "Y" || answer == "yes");
}

int deleteAll(const CommandOptions& options, const Json& traces) {
  Json deleted = Json::array();
  int status = kOk;
  for (const Json& trace : traces) {
    const std::string name = textAt(trace, "name");
    if (const auto reply = deleteOne(options, name); !reply) {
      status = report(reply.error(), options.json);
      break;
    }
    deleted.push_back(trace);
    if (!options.json) fmt::print("deleted {}\n", name);
  }
  if (options.json) {
    printJson({{"deleted", deleted}});
  } else if (deleted.size() > 1) {
    fmt::print("deleted {}\n", traceSumText(deleted));
  }
  return status;
}

int deleteSeveral(const CommandOptions& options, const DeleteWords& words) {
  const auto reply = callOnce(options, kListTraces);
  if (!reply) return report(reply.error(), options.json);
  const auto now_ns = nowBeside(*reply);
  if (!words.older_than.empty() && !now_ns) {
    return report(base::Error{"", "the clock of this computer is not set, so that no age is known",
                              "set the clock, or name the traces"},
                  options.json);
  }
  const TraceDeletion deletion =
      words.older_than.empty() ? deletionOf(words.names, *reply)
                               : deletionBefore(timeFrom(words.older_than, *now_ns).value_or(0), *reply);
  if (!deletion.problems.empty()) {
    std::string text = "nothing was deleted:";
    for (const std::string& problem : deletion.problems) text += " " + problem + ";";
    text.pop_back();
    return report(base::Error{"", text, ""}, options.json);
  }
  if (!options.json) {
    for (const std::string& staying : deletion.staying) fmt::print(stderr, "hapticctl: {}\n", staying);
  }
  if (deletion.to_delete.empty()) {
    if (options.json) {
      printJson({{"deleted", Json::array()}});
    } else {
      fmt::print("there is nothing to delete\n");
    }
    return kOk;
  }
  if (!words.yes) {
    fmt::print(
        stderr, "{}",
        traceListText(deletion.to_delete, {{"traces", deletion.to_delete}}, now_ns, terminalSize().columns));
    if (!isConfirmed("delete them?")) {
      return report(base::Error{"", "nothing was deleted", "answer y, or give --yes"}, options.json);
    }
  }
  return deleteAll(options, deletion.to_delete);
}

int runDelete(const CommandOptions& options, const DeleteWords& words) {
  if (words.names.empty() == words.older_than.empty()) {
    return reportUsage("hapticctl trace delete", "either names of traces or --older-than is required",
                       options.json);
  }
  // a single trace is deleted as it is named, without a look at the others
  if (words.names.size() == 1) return deleteAll(options, Json::array({{{"name", words.names.front()}}}));
  return deleteSeveral(options, words);
}

void addList(CommandLine& line, CLI::App& group) {
  const CommandOptions& options = line.options();
  const auto words = std::make_shared<ListWords>();
  CLI::App& list = line.add(group, "list", "List the traces with their age and size, the oldest first",
                            [&options, words] { return runList(options, *words); });
  list.add_option("--label", words->options.label, "Only traces with this text in their label")
      ->type_name("TEXT");
  list.add_option(
          "--since", words->since,
          "Only traces started since then: a time in UTC (2026-03-04, \"2026-03-04 05:06\") or an age (12h)")
      ->type_name("TIME")
      ->check(isTime());
  list.add_option("--until", words->until, "Only traces started until then; takes the same forms")
      ->type_name("TIME")
      ->check(isTime());
  list.add_option("--state", words->options.state, "Only traces that are being written, finished or kept")
      ->type_name("STATE")
      ->check(CLI::IsMember({"writing", "finished", "kept"}));
  list.add_option("--sort", words->options.sort, "By time (default), name or size")
      ->type_name("KEY")
      ->check(CLI::IsMember({"time", "name", "size"}));
  list.add_flag("-r,--reverse", words->options.reverse, "Reverse the order");
  addNames(list, words->names_only);
}

void addDelete(CommandLine& line, CLI::App& group) {
  const CommandOptions& options = line.options();
  const auto words = std::make_shared<DeleteWords>();
  CLI::App& command =
      line.add(group, "delete",
               "Delete finished traces and damaged originals by name or by age; asks before it\n"
               "deletes several. Traces that are kept or being written stay",
               [&options, words] { return runDelete(options, *words); });
  command.add_option("NAME", words->names, "Names of traces")->type_name("TRACE");
  command.add_option("--older-than", words->older_than, "Traces that began longer ago, such as 30d or 12h")
      ->type_name("AGE")
      ->check(isAge());
  command.add_flag("--yes", words->yes, "Delete without asking");
}

void addKeep(CommandLine& line, CLI::App& group) {
  const CommandOptions& options = line.options();
  const auto name = std::make_shared<std::string>();
  const auto undo = std::make_shared<bool>(false);
  CLI::App& keep = line.add(group, "keep", "Mark a trace so that nothing deletes it", [&options, name, undo] {
    const Json parameters{{"name", *name}, {"keep", !*undo}};
    return callAndPrint(options, {"io.hapticd.Control.KeepTrace", parameters, true, kDiskLimit},
                        [&](const Json&) {
                          return fmt::format("{} is {}\n", printable(*name),
                                             *undo ? "no longer kept" : "kept");
                        },
                        {{"name", *name}, {"kept", !*undo}});
  });
  keep.add_option("NAME", *name, "Name of the trace")->type_name("TRACE")->required();
  keep.add_flag("--undo", *undo, "Remove the mark");
}

void addNote(CommandLine& line, CLI::App& group) {
  const CommandOptions& options = line.options();
  const auto name = std::make_shared<std::string>();
  const auto text = std::make_shared<std::string>();
  CLI::App& note = line.add(
      group, "note", "Attach a line of text to a trace, which list and info show", [&options, name, text] {
        const Json parameters{{"name", *name}, {"text", *text}};
        return callAndPrint(options, {"io.hapticd.Control.NoteTrace", parameters, true, kDiskLimit},
                            [&](const Json&) {
                              return text->empty() ? fmt::format("removed the note of {}\n", printable(*name))
                                                   : fmt::format("noted for {}: {}\n", printable(*name),
                                                                 printable(*text));
                            },
                            {{"name", *name}, {"note", *text}});
      });
  note.add_option("NAME", *name, "Name of the trace")->type_name("TRACE")->required();
  note.add_option("TEXT", *text, "The note, at most 200 bytes; it replaces an earlier one. Empty: remove it")
      ->type_name("TEXT")
      ->required();
}

/// Adds the commands for the daemon's folder of traces: list, delete, keep, note.
void addTraceFolderCommands(CommandLine& line, CLI::App& group) {
  addList(line, group);
  addDelete(line, group);
  addKeep(line, group);
  addNote(line, group);
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
             return callAndPrint(options, {"io.hapticd.Control.MarkTrace", {{"text", *text}}, true},
                                 [&](const Json& reply) {
                                   return fmt::format("marked {}: {}\n", textAt(reply, "name"),
                                                      printable(*text));
                                 },
                                 {{"text", *text}});
           })
      .add_option("TEXT", *text, "Text of the mark, at most 200 bytes; the plot shows it")
      ->type_name("TEXT")
      ->required();
}

}  // namespace

void addTraceCommands(CommandLine& line) {
  CLI::App& group = line.addGroup("trace", "Record the force loop, and work with the recordings");
  addRecording(line, group);
  addMark(line, group);
  addTraceFolderCommands(line, group);
  line.addAllHelped({"trace info", "trace breaches", "trace export", "trace recover", "trace plot"});
}

}  // namespace hapticd::tools
