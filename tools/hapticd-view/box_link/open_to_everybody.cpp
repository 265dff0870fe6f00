// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/box_link/open_to_everybody.h"

#include <utility>

#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools::view {
namespace {

constexpr const char* kParameter = "control.depth_for_everyone";
constexpr std::chrono::seconds kSilence{1};
/// So long an answer holds, so that clients without a token cannot keep the daemon busy.
constexpr std::chrono::seconds kHolds{2};

}  // namespace

OpenToEverybody::OpenToEverybody(boost::asio::io_context& context, std::string socket)
    : context_(context), socket_(std::move(socket)) {}

void OpenToEverybody::ask(Answer answer) {
  const auto now = std::chrono::steady_clock::now();
  if (!call_ && known_ && now - asked_ < kHolds) return answer(is_open_);
  waiting_.push_back(std::move(answer));
  if (call_) return;
  asked_ = now;
  is_open_ = false;
  call_ = std::make_shared<VarlinkStream>(context_, kSilence);
  call_->start(socket_, "io.hapticd.Status.GetParameters", {{"names", Json::array({kParameter})}},
               /*more=*/false,
               {[this](const Json& reply, const base::Descriptor&) {
                  const Json& rows = listAt(reply, "parameters");
                  is_open_ = rows.size() == 1 && flagAt(rows[0], "value");
                },
                [this](const ClientError&) { answerAll(); }});
}

void OpenToEverybody::answerAll() {
  call_.reset();
  known_ = true;
  for (const Answer& answer : std::exchange(waiting_, {})) answer(is_open_);
}

}  // namespace hapticd::tools::view
