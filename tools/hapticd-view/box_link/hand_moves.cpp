// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/box_link/hand_moves.h"

#include <fmt/format.h>

#include <string_view>
#include <utility>

#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools::view {
namespace {

constexpr const char* kMethod = "io.hapticd.Control.MoveHand";
constexpr std::string_view kDenied = "org.varlink.service.PermissionDenied";
/// For an answer of the box; a connection without a call ends after it too, which is no problem.
constexpr std::chrono::milliseconds kSilence{2000};

std::string problemOf(const ClientError& error) {
  if (error.what == kDenied) return "the box does not let the user of hapticd-view move the hand";
  if (fieldAt(error.parameters, "reason") != nullptr) return textAt(error.parameters, "reason");
  return error.remedy.empty() ? error.what : fmt::format("{} ({})", error.what, error.remedy);
}

}  // namespace

HandMoves::~HandMoves() {
  if (call_) call_->stop();
}

void HandMoves::request(Viewer& viewer, const rt::Vec3& target_m_in_world) {
  const auto now = now_();
  if (owner_ != &viewer) {
    if (owner_ != nullptr && now - heard_ < kTurn)
      return viewer.onHandAnswer("another page moves the hand (let it go there, and try again after 2 s)");
    owner_ = &viewer;
    told_.reset();
  }
  heard_ = now;
  if (now < again_) return;
  next_ = target_m_in_world;
  send();
}

void HandMoves::forget(const Viewer& viewer) {
  if (owner_ != &viewer) return;
  owner_ = nullptr;
  next_.reset();
}

void HandMoves::send() {
  if (waits_ || !next_) return;
  const rt::Vec3 target = *std::exchange(next_, std::nullopt);
  const Json parameters{{"targetMInWorld", {target.x, target.y, target.z}}};
  waits_ = true;
  if (call_) return call_->callAgain(parameters);
  call_ = std::make_shared<VarlinkStream>(context_, kSilence);
  call_->keepOpen();
  call_->start(socket_, kMethod, parameters, /*more=*/false,
               {.on_reply =
                    [this](const Json&, const base::Descriptor&) {
                      waits_ = false;
                      tell("");
                      send();
                    },
                .on_end = [this](const ClientError& error) { onEnd(error); }});
}

void HandMoves::onEnd(const ClientError& error) {
  call_.reset();
  if (!std::exchange(waits_, false)) return;
  next_.reset();
  again_ = now_() + kPause;
  tell(problemOf(error));
}

void HandMoves::tell(const std::string& problem) {
  if (owner_ == nullptr || told_ == problem) return;
  told_ = problem;
  owner_->onHandAnswer(problem);
}

}  // namespace hapticd::tools::view
