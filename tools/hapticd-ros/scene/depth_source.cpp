// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/scene/depth_source.h"

#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools::ros {

ClientResult<void> DepthSource::open() {
  close();
  auto connected = VarlinkClient::connect(socket_);
  if (!connected) return std::unexpected(connected.error());
  link_.emplace(std::move(*connected));
  link_->interruptBy(interrupt_);
  auto asked = link_->subscribe("io.hapticd.Status.ShareDepth", Json::object());
  if (!asked) return asked;
  const auto reply = link_->next(kSilence);
  if (!reply) return std::unexpected(reply.error());
  auto region = drivers::DepthRegionReader::open(link_->takeDescriptor());
  if (!region)
    return std::unexpected(
        ClientError{ClientError::Kind::no_connection, region.error().text(), "", Json::object(), 0});
  region_.emplace(std::move(*region));
  seen_ = region_->changes() - 1;  // a frame that was there before is taken at once
  return {};
}

void DepthSource::close() {
  region_.reset();
  link_.reset();
}

bool DepthSource::wait(std::chrono::milliseconds limit) {
  if (!region_) return false;
  const bool has_come = region_->wait(seen_, limit);
  seen_ = region_->changes();
  if (!region_->closed() && (has_come || isLinked())) return has_come;
  close();
  return false;
}

/// A hapticd that was killed has not marked its memory as closed.
bool DepthSource::isLinked() {
  const auto reply = link_->next(std::chrono::milliseconds(0));
  return !reply && reply.error().kind == ClientError::Kind::no_answer;
}

}  // namespace hapticd::tools::ros
