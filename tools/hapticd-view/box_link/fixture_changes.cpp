// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/box_link/fixture_changes.h"

#include <fmt/format.h>

#include <utility>

#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools::view {
namespace {

/// The box answers within a few milliseconds, or after its force loop did not respond for a second.
constexpr std::chrono::milliseconds kSilence{5000};

/// Why the box has not done it, in words.
std::string problemOf(const ClientError& error) {
  const Json& refused = error.parameters;
  if (!refused.is_object() || !refused.contains("reason"))
    return error.remedy.empty() ? error.what : fmt::format("{} ({})", error.what, error.remedy);
  const std::string field = textAt(refused, "field");
  const std::string remedy = textAt(refused, "remedy");
  return fmt::format("{}{}{}", field == "-" ? "" : field + " ", textAt(refused, "reason"),
                     remedy == "-" ? "" : fmt::format(" ({})", remedy));
}

}  // namespace

FixtureChanges::~FixtureChanges() {
  if (call_) call_->stop();
}

void FixtureChanges::request(const FixtureRequest& request, Answer answer) {
  const auto now = Clock::now();
  if (call_ || now - last_ < kPause) return answer("the last request was a moment ago (try again)");
  if (request.add.is_null() && !added_.contains(request.remove))
    return answer("only fixtures that were added here can be removed here (hapticctl fixture remove)");
  last_ = now;
  requested_ = request;
  answer_ = std::move(answer);
  const Json parameters =
      request.add.is_null() ? Json{{"remove", {request.remove}}} : Json{{"add", Json::array({request.add})}};
  call_ = std::make_shared<VarlinkStream>(context_, kSilence);
  call_->start(socket_, "io.hapticd.Control.ChangeFixtures", parameters, /*more=*/false,
               {.on_reply =
                    [this](const Json&, const base::Descriptor&) {
                      if (requested_.add.is_null()) {
                        added_.erase(requested_.remove);
                      } else {
                        added_.insert(nameIn(requested_));
                      }
                      finish("");
                    },
                .on_end =
                    [this](const ClientError& error) {
                      if (answer_) finish(problemOf(error));
                      call_.reset();
                    }});
}

void FixtureChanges::finish(const std::string& problem) {
  if (const Answer answer = std::exchange(answer_, nullptr)) answer(problem);
}

}  // namespace hapticd::tools::view
