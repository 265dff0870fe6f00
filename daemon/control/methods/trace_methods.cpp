// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/methods/methods.h"

#include <fmt/format.h>

#include <deque>
#include <filesystem>
#include <functional>
#include <utility>

#include "config/base/value_text.h"
#include "daemon/control/base/method_context.h"

namespace hapticd::daemon {
namespace {

using Unawaited = PendingAnswers::Unawaited;

constexpr const char* kFailed = "io.hapticd.Control.TraceFailed";
constexpr std::size_t kMaxLabelLength = 64;
constexpr std::size_t kMaxListed = 1000;
/// Largest size of the traces in a reply, so that it stays below kMaxReplyBytes.
constexpr std::size_t kMaxListedBytes = 240 * 1024;
constexpr std::size_t kMaxMarkLength = 200;

bool isLabel(std::string_view text) {
  return text.size() <= kMaxLabelLength &&
         text.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_.-") ==
             std::string_view::npos;
}

OrderedJson entryJson(const trace::TraceEntry& entry) {
  const auto& [name, bytes, time_ns, open, damaged, depth, kept, note, begin_ns, clock_is_set, number] =
      entry;
  return {
      {"name", name},        {"bytes", bytes},
      {"timeNs", time_ns},   {"open", open},
      {"damaged", damaged},  {"depth", depth},
      {"kept", kept},        {"note", note},
      {"beginNs", begin_ns}, {"clockIsSet", clock_is_set ? OrderedJson(*clock_is_set) : OrderedJson(nullptr)},
      {"number", number}};
}

Reply listReply(const base::Result<std::vector<trace::TraceEntry>>& entries, const std::string& folder) {
  if (!entries) return failed("io.hapticd.Status.ListFailed", entries.error().text());
  std::deque<OrderedJson> newest;
  std::size_t length = 0;
  for (auto entry = entries->rbegin(); entry != entries->rend() && newest.size() < kMaxListed; ++entry) {
    OrderedJson trace = entryJson(*entry);
    length += trace.dump(-1, ' ', false, OrderedJson::error_handler_t::replace).size() + 1;
    if (length > kMaxListedBytes) break;
    newest.push_front(std::move(trace));
  }
  const std::size_t omitted = entries->size() - newest.size();
  return {"", {{"traces", OrderedJson(newest)}, {"folder", folder}, {"omitted", omitted}}};
}

Reply full() {
  return failed(kFailed, PendingAnswers::kFullReason);
}

}  // namespace

std::vector<Method> TraceMethods::methods() {
  using enum MethodParameter::Need;
  using Self = TraceMethods;
  return {
      methodOf(this, "io.hapticd.Status.ListTraces", &Self::listTraces),
      methodOf(this, "io.hapticd.Control.StartTrace", &Self::startTrace,
               {{"label", isText}, {"depth", isFlag}}),
      methodOf(this, "io.hapticd.Control.StopTrace", &Self::stopTrace),
      methodOf(this, "io.hapticd.Control.DumpTrace", &Self::dumpTrace),
      methodOf(this, "io.hapticd.Control.DeleteTrace", &Self::deleteTrace, {{"name", isText, required}}),
      methodOf(this, "io.hapticd.Control.KeepTrace", &Self::keepTrace,
               {{"name", isText, required}, {"keep", isFlag}}),
      methodOf(this, "io.hapticd.Control.NoteTrace", &Self::noteTrace,
               {{"name", isText, required}, {"text", isText}}),
      methodOf(this, "io.hapticd.Control.MarkTrace", &Self::markTrace, {{"text", isText, required}}),
  };
}

Answer TraceMethods::listTraces(const Call&, const Caller&) {
  if (context_.pending.full(Access::read)) {
    return failed("io.hapticd.Status.ListFailed", PendingAnswers::kFullReason);
  }
  using Entries = base::Result<std::vector<trace::TraceEntry>>;
  const std::string folder = std::filesystem::path(context_.box.settings().state.folder) / "traces";
  return Later{Unawaited::finish,
               whenReady<Entries>(context_.box.listTraces(),
                                  [folder](const Entries& entries) { return listReply(entries, folder); })};
}

Answer TraceMethods::startTrace(const Call& call, const Caller& caller) {
  const auto label = optionalText(call, "label");
  const auto depth = optionalFlag(call, "depth");
  const TraceRequest request{label.value_or(""), depth.value_or(context_.box.settings().trace.depth)};
  if (!isLabel(request.label)) {
    return failed(
        kFailed,
        fmt::format("the label contains characters that a file name cannot have (take at most {} letters, "
                    "digits, '_', '.' and '-')",
                    kMaxLabelLength));
  }
  if (context_.pending.full(Access::control)) return full();
  return answerWhenDone(caller, context_.box.startTrace(request), "start", "starts trace");
}

Answer TraceMethods::stopTrace(const Call&, const Caller& caller) {
  if (context_.pending.full(Access::control)) return full();
  return answerWhenDone(caller, context_.box.stopTrace(), "stop", "stops trace");
}

Answer TraceMethods::dumpTrace(const Call&, const Caller& caller) {
  if (context_.pending.full(Access::control)) return full();
  return answerWhenDone(caller, context_.box.dumpTrace(), "dump", "writes the flight recorder out as trace");
}

Answer TraceMethods::answerWhenDone(const Caller& caller, Named named, const char* action,
                                    const char* change) {
  using Name = base::Result<std::string>;
  const auto reply = [this, caller, action, change](const Name& name) {
    if (!name) return failed(kFailed, name.error().text());
    logChange(context_, caller, fmt::format("{} {}", change, *name), config::EventKind::trace,
              {{"ACTION", action}, {"TRACE", *name}});
    return Reply{"", {{"name", *name}}};
  };
  return Later{Unawaited::finish, whenReady<Name>(std::move(named), reply)};
}

Answer TraceMethods::deleteTrace(const Call& call, const Caller& caller) {
  const auto name = requiredText(call, "name");
  if (context_.pending.full(Access::control)) return full();
  return answerWhenDone(caller, context_.box.deleteTrace(name), name, "delete", "deletes trace");
}

Answer TraceMethods::keepTrace(const Call& call, const Caller& caller) {
  const auto keep = optionalFlag(call, "keep");
  const auto name = requiredText(call, "name");
  if (context_.pending.full(Access::control)) return full();
  const bool mark = keep.value_or(true);
  return answerWhenDone(caller, context_.box.keepTrace(name, mark), name, mark ? "keep" : "unkeep",
                        mark ? "marks to be kept: trace" : "takes the mark to be kept from trace");
}

Answer TraceMethods::noteTrace(const Call& call, const Caller& caller) {
  const auto note = optionalText(call, "text");
  const auto name = requiredText(call, "name");
  if (context_.pending.full(Access::control)) return full();
  const std::string text = note.value_or("");
  return answerWhenDone(caller, context_.box.noteTrace(name, text), name, "note",
                        text.empty() ? "removes the note of trace" : "changes the note of trace");
}

/// The event reaches the trace as every other one does, with the time at which it is logged.
Answer TraceMethods::markTrace(const Call& call, const Caller& caller) {
  const auto text = requiredText(call, "text");
  if (text.empty() || text.size() > kMaxMarkLength || base::printable(text) != text) {
    return failed(kFailed, fmt::format("a mark takes one line of 1 to {} bytes", kMaxMarkLength));
  }
  const TraceStatus trace = context_.box.status().trace;
  if (trace.state != TraceState::writing) {
    return failed(kFailed, "there is nothing to mark: no trace is being written (hapticctl trace start)");
  }
  logChange(context_, caller, "marks: " + text, config::EventKind::mark,
            {{"MARK", text}, {"TRACE", trace.name}});
  return Reply{"", {{"name", trace.name}}};
}

Answer TraceMethods::answerWhenDone(const Caller& caller, Done done, const std::string& name,
                                    const char* action, const char* change) {
  using Outcome = base::Result<void>;
  const auto reply = [this, caller, name, action, change](const Outcome& outcome) {
    if (!outcome) return failed(kFailed, outcome.error().text());
    logChange(context_, caller, fmt::format("{} {}", change, name), config::EventKind::trace,
              {{"ACTION", action}, {"TRACE", name}});
    return Reply{};
  };
  return Later{Unawaited::finish, whenReady<Outcome>(std::move(done), reply)};
}

}  // namespace hapticd::daemon
