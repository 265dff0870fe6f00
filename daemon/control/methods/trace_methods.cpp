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

}  // namespace

std::vector<Method> TraceMethods::methods() {
  using enum Access;
  using Self = TraceMethods;
  return {
      {.name = "io.hapticd.Status.ListTraces", .answer = std::bind_front(&Self::listTraces, this)},
      {.name = "io.hapticd.Control.StartTrace",
       .access = control,
       .parameters = {"label", "depth"},
       .answer = std::bind_front(&Self::startTrace, this)},
      {.name = "io.hapticd.Control.StopTrace",
       .access = control,
       .answer = std::bind_front(&Self::stopTrace, this)},
      {.name = "io.hapticd.Control.DumpTrace",
       .access = control,
       .answer = std::bind_front(&Self::dumpTrace, this)},
      {.name = "io.hapticd.Control.DeleteTrace",
       .access = control,
       .parameters = {"name"},
       .answer = std::bind_front(&Self::deleteTrace, this)},
      {.name = "io.hapticd.Control.KeepTrace",
       .access = control,
       .parameters = {"name", "keep"},
       .answer = std::bind_front(&Self::keepTrace, this)},
      {.name = "io.hapticd.Control.NoteTrace",
       .access = control,
       .parameters = {"name", "text"},
       .answer = std::bind_front(&Self::noteTrace, this)},
      {.name = "io.hapticd.Control.MarkTrace",
       .access = control,
       .parameters = {"text"},
       .answer = std::bind_front(&Self::markTrace, this)},
  };
}

bool TraceMethods::refused(const Caller& caller, Replies& replies) {
  if (!context_.pending.full(Access::control)) return false;
  replies.finish(caller.connection, failed(kFailed, PendingAnswers::kFullReason));
  return true;
}

void TraceMethods::listTraces(const Call& call, const Caller& caller, Replies& replies) {
  if (context_.pending.full(Access::read)) {
    return replies.finish(caller.connection,
                          failed("io.hapticd.Status.ListFailed", PendingAnswers::kFullReason));
  }
  using Entries = base::Result<std::vector<trace::TraceEntry>>;
  const std::string folder = std::filesystem::path(context_.box.settings().state.folder) / "traces";
  context_.pending.add(call, caller, replies, Unawaited::finish,
                       whenReady<Entries>(context_.box.listTraces(), [folder](const Entries& entries) {
                         return listReply(entries, folder);
                       }));
}

void TraceMethods::startTrace(const Call& call, const Caller& caller, Replies& replies) {
  const auto label = textField(call, "label");
  if (!label) return replies.finish(caller.connection, label.error());
  const auto depth = flagField(call, "depth");
  if (!depth) return replies.finish(caller.connection, depth.error());
  const TraceRequest request{label->value_or(""), depth->value_or(context_.box.settings().trace.depth)};
  if (!isLabel(request.label)) {
    return replies.finish(
        caller.connection,
        failed(kFailed,
               fmt::format(
                   "the label contains characters that a file name cannot have (take at most {} letters, "
                   "digits, '_', '.' and '-')",
                   kMaxLabelLength)));
  }
  if (refused(caller, replies)) return;
  answerWhenDone(call, caller, replies, context_.box.startTrace(request), "start", "starts trace");
}

void TraceMethods::stopTrace(const Call& call, const Caller& caller, Replies& replies) {
  if (refused(caller, replies)) return;
  answerWhenDone(call, caller, replies, context_.box.stopTrace(), "stop", "stops trace");
}

void TraceMethods::dumpTrace(const Call& call, const Caller& caller, Replies& replies) {
  if (refused(caller, replies)) return;
  answerWhenDone(call, caller, replies, context_.box.dumpTrace(), "dump",
                 "writes the flight recorder out as trace");
}

void TraceMethods::answerWhenDone(const Call& call, const Caller& caller, Replies& replies, Named named,
                                  const char* action, const char* change) {
  using Name = base::Result<std::string>;
  const auto reply = [this, caller, action, change](const Name& name) {
    if (!name) return failed(kFailed, name.error().text());
    logChange(context_, caller, fmt::format("{} {}", change, *name), config::EventKind::trace,
              {{"ACTION", action}, {"TRACE", *name}});
    return Reply{"", {{"name", *name}}};
  };
  context_.pending.add(call, caller, replies, Unawaited::finish, whenReady<Name>(std::move(named), reply));
}

void TraceMethods::deleteTrace(const Call& call, const Caller& caller, Replies& replies) {
  const auto name = requiredText(call, "name");
  if (!name) return replies.finish(caller.connection, name.error());
  if (refused(caller, replies)) return;
  answerWhenDone(call, caller, replies, context_.box.deleteTrace(*name), *name, "delete", "deletes trace");
}

void TraceMethods::keepTrace(const Call& call, const Caller& caller, Replies& replies) {
  const auto keep = flagField(call, "keep");
  if (!keep) return replies.finish(caller.connection, keep.error());
  const auto name = requiredText(call, "name");
  if (!name) return replies.finish(caller.connection, name.error());
  if (refused(caller, replies)) return;
  const bool mark = keep->value_or(true);
  answerWhenDone(call, caller, replies, context_.box.keepTrace(*name, mark), *name, mark ? "keep" : "unkeep",
                 mark ? "marks to be kept: trace" : "takes the mark to be kept from trace");
}

void TraceMethods::noteTrace(const Call& call, const Caller& caller, Replies& replies) {
  const auto note = textField(call, "text");
  if (!note) return replies.finish(caller.connection, note.error());
  const auto name = requiredText(call, "name");
  if (!name) return replies.finish(caller.connection, name.error());
  if (refused(caller, replies)) return;
  const std::string text = note->value_or("");
  answerWhenDone(call, caller, replies, context_.box.noteTrace(*name, text), *name, "note",
                 text.empty() ? "removes the note of trace" : "changes the note of trace");
}

/// The event reaches the trace as every other one does, with the time at which it is logged.
void TraceMethods::markTrace(const Call& call, const Caller& caller, Replies& replies) {
  const auto text = requiredText(call, "text");
  if (!text) return replies.finish(caller.connection, text.error());
  if (text->empty() || text->size() > kMaxMarkLength || base::printable(*text) != *text) {
    return replies.finish(
        caller.connection,
        failed(kFailed, fmt::format("a mark takes one line of 1 to {} bytes", kMaxMarkLength)));
  }
  const TraceStatus trace = context_.box.status().trace;
  if (trace.state != TraceState::writing) {
    return replies.finish(
        caller.connection,
        failed(kFailed, "there is nothing to mark: no trace is being written (hapticctl trace start)"));
  }
  logChange(context_, caller, "marks: " + *text, config::EventKind::mark,
            {{"MARK", *text}, {"TRACE", trace.name}});
  replies.finish(caller.connection, {"", {{"name", trace.name}}});
}

void TraceMethods::answerWhenDone(const Call& call, const Caller& caller, Replies& replies, Done done,
                                  const std::string& name, const char* action, const char* change) {
  using Outcome = base::Result<void>;
  const auto reply = [this, caller, name, action, change](const Outcome& outcome) {
    if (!outcome) return failed(kFailed, outcome.error().text());
    logChange(context_, caller, fmt::format("{} {}", change, name), config::EventKind::trace,
              {{"ACTION", action}, {"TRACE", name}});
    return Reply{};
  };
  context_.pending.add(call, caller, replies, Unawaited::finish, whenReady<Outcome>(std::move(done), reply));
}

}  // namespace hapticd::daemon
