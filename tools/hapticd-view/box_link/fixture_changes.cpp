// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/box_link/fixture_changes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <string_view>
#include <utility>

#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools::view {
namespace {

constexpr const char* kMethod = "io.hapticd.Control.ChangeFixtures";
constexpr std::string_view kNotApplied = "io.hapticd.Control.NotApplied";
constexpr std::string_view kMeanwhile = "io.hapticd.Control.ChangedMeanwhile";
constexpr std::string_view kDenied = "org.varlink.service.PermissionDenied";
/// The box answers within a few milliseconds, or after its force loop did not respond for a second.
constexpr std::chrono::milliseconds kSilence{5000};

std::string refusal(std::string_view why) {
  return fmt::format("nothing was changed: {}", why);
}

/// Whether the box may have done what it was asked for all the same: it took the change and its loop did not,
/// or the connection broke after the call was sent.
bool mayBeDone(const ClientError& error) {
  if (error.what == kNotApplied) return true;
  const bool unreached = error.system_error == ENOENT || error.system_error == ECONNREFUSED ||
                         error.system_error == EACCES || error.system_error == EPERM;
  return error.kind != ClientError::Kind::error_reply && !unreached;
}

/// Why the box has not done it, in words.
std::string reasonOf(const ClientError& error) {
  if (error.what == kNotApplied) return "the force loop has not taken it over in time";
  if (error.what == kMeanwhile) return "somebody has just changed the fixtures (try again)";
  if (error.what == kDenied) return "the box no longer lets the user of hapticd-view change fixtures";
  const Json& refused = error.parameters;
  if (!refused.is_object() || !refused.contains("reason"))
    return error.remedy.empty() ? error.what : fmt::format("{} ({})", error.what, error.remedy);
  const std::string field = textAt(refused, "field");
  const std::string remedy = textAt(refused, "remedy");
  return fmt::format("{}{}{}", field == "-" ? "" : field + " ", textAt(refused, "reason"),
                     remedy == "-" || remedy.empty() ? "" : fmt::format(" ({})", remedy));
}

std::string problemOf(const ClientError& error) {
  return mayBeDone(error) ? fmt::format("it is not known whether this was done: {}; see the list of fixtures",
                                        reasonOf(error))
                          : refusal(reasonOf(error));
}

/// A generation of the fixtures; 0: none is stated.
std::uint64_t generationAt(const Json& json, std::string_view member) {
  const Json* const number = fieldAt(json, member);
  return number != nullptr && number->is_number_unsigned() ? number->get<std::uint64_t>() : 0;
}

}  // namespace

base::Result<void> mayControl(const std::string& control_socket, const char* option) {
  const auto refused = [&](const std::string& what, const char* remedy) {
    return std::unexpected(base::Error{option, what, remedy});
  };
  constexpr const char* kMembers =
      "start hapticd-view as a member of the group haptic, or without this option";
  auto client = VarlinkClient::connect(control_socket);
  if (!client) {
    const bool denied = client.error().system_error == EACCES || client.error().system_error == EPERM;
    return refused(client.error().what,
                   denied ? kMembers : "start hapticd first, or name its socket with --control-socket");
  }
  // No set of fixtures has this generation: who may change fixtures is told that somebody else has, others
  // that they may not.
  const auto reply = client->call(kMethod, {{"generation", -1}});
  if (!reply && reply.error().what == kMeanwhile) return {};
  if (!reply && reply.error().what == kDenied)
    return refused("this user may not control the box through " + control_socket, kMembers);
  return refused(reply ? control_socket + ": the answer is not one of hapticd" : reasonOf(reply.error()), "");
}

FixtureChanges::~FixtureChanges() {
  if (call_) call_->stop();
}

void FixtureChanges::request(const Viewer& viewer, const FixtureRequest& request, Answer answer) {
  const auto now = now_();
  if (call_ || (last_ && now - *last_ < kPause))
    return answer(refusal("the last request was a moment ago (try again)"));
  const Added* const added = request.add.is_null() ? addedBy(viewer, request.remove) : nullptr;
  if (request.add.is_null() && added == nullptr) {
    return answer(
        refusal("only fixtures that were added here, and that nobody has changed since, can be removed here "
                "(hapticctl fixture remove)"));
  }
  last_ = now;
  viewer_ = &viewer;
  requested_ = request;
  answer_ = std::move(answer);
  // what the name stands for may have changed since
  const Json parameters = added != nullptr ? Json{{"remove", {request.remove}}, {"generation", added->known}}
                                           : Json{{"add", Json::array({request.add})}};
  call_ = std::make_shared<VarlinkStream>(context_, kSilence);
  call_->start(socket_, kMethod, parameters, /*more=*/false,
               {.on_reply = [this](const Json& reply, const base::Descriptor&) { onDone(reply); },
                .on_end =
                    [this](const ClientError& error) {
                      if (answer_) finish(problemOf(error));
                      call_.reset();
                    }});
}

void FixtureChanges::onDone(const Json& reply) {
  const std::string name = nameIn(requested_);
  std::erase_if(added_, [&](const Added& each) { return each.name == name; });
  if (viewer_ != nullptr && !requested_.add.is_null()) {
    const std::uint64_t generation = generationAt(reply, "generation");
    added_.push_back({viewer_, name, generation, generation});
  }
  if (added_.size() > kMaxAdded) added_.erase(added_.begin());
  finish("");
}

void FixtureChanges::follow(const Json& additions) {
  const std::uint64_t generation = generationAt(additions, "generation");
  std::erase_if(added_, [&](Added& each) {
    if (generation <= each.known) return false;  // fetched before the box has added it
    each.known = generation;
    return std::ranges::none_of(listAt(additions, "fixtures"), [&](const Json& entry) {
      return textAt(entry, "name") == each.name && generationAt(entry, "definedIn") == each.made;
    });
  });
}

void FixtureChanges::forget(const Viewer& viewer) {
  std::erase_if(added_, [&](const Added& each) { return each.viewer == &viewer; });
  if (viewer_ != &viewer) return;
  viewer_ = nullptr;
  if (answer_) answer_ = [](const std::string&) {};
}

const FixtureChanges::Added* FixtureChanges::addedBy(const Viewer& viewer, const std::string& name) const {
  const auto found = std::ranges::find_if(
      added_, [&](const Added& each) { return each.viewer == &viewer && each.name == name; });
  return found == added_.end() ? nullptr : &*found;
}

void FixtureChanges::finish(const std::string& problem) {
  if (const Answer answer = std::exchange(answer_, nullptr)) answer(problem);
}

}  // namespace hapticd::tools::view
