// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/box_link/solid_shapes.h"

#include <algorithm>
#include <chrono>
#include <set>
#include <utility>

#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools::view {
namespace {

/// The box computes one in a fraction of a second, after those that others have asked for.
constexpr std::chrono::milliseconds kSilence{5000};

/// The solids of fixtures, each once, in the order of the fixtures.
std::deque<std::string> solidsOf(const Json& fixtures) {
  std::deque<std::string> solids;
  if (!fixtures.is_array()) return solids;
  for (const Json& entry : fixtures) {
    const Json* const solid = fieldAt(entry, "definition.solid");
    if (solid == nullptr || !solid->is_string()) continue;
    auto sha256 = solid->get<std::string>();
    if (std::ranges::find(solids, sha256) == solids.end()) solids.push_back(std::move(sha256));
  }
  return solids;
}

}  // namespace

SolidShapes::SolidShapes(boost::asio::io_context& context, std::string socket, OnChange on_change)
    : context_(context), socket_(std::move(socket)), on_change_(std::move(on_change)) {}

void SolidShapes::forget() {
  if (call_) call_->stop();
  call_.reset();
  waiting_.clear();
  changed_ = false;
  shapes_ = Json::object();
}

void SolidShapes::follow(const Json& fixtures) {
  waiting_ = solidsOf(fixtures);
  const std::set<std::string> wanted(waiting_.begin(), waiting_.end());
  Json kept = Json::object();
  for (auto shape = shapes_.begin(); shape != shapes_.end(); ++shape) {
    if (wanted.contains(shape.key())) kept[shape.key()] = std::move(shape.value());
  }
  shapes_ = std::move(kept);
  std::erase_if(waiting_, [this](const std::string& sha256) { return shapes_.contains(sha256); });
  if (!call_) askNext();
}

void SolidShapes::askNext() {
  if (waiting_.empty()) {
    if (std::exchange(changed_, false)) on_change_(shapes_);
    return;
  }
  const std::string sha256 = std::move(waiting_.front());
  waiting_.pop_front();
  call_ = std::make_shared<VarlinkStream>(context_, kSilence);
  const auto on_reply = [this, sha256](const Json& reply, const base::Descriptor&) {
    // follow() may have put it there once more
    std::erase(waiting_, sha256);
    shapes_[sha256] = reply;
    changed_ = true;
  };
  const auto on_end = [this](const ClientError&) {
    call_.reset();
    askNext();
  };
  call_->start(socket_, "io.hapticd.Status.GetSolid", {{"solid", sha256}}, /*more=*/false,
               {on_reply, on_end});
}

}  // namespace hapticd::tools::view
