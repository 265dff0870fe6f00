// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/trace_head.h"

#include "drivers/trace/mcap_reader.h"
#include "drivers/trace/messages.h"

namespace hapticd::drivers {
namespace {

/// Searches the channels: hapticd defines all of them before the first message, other programs anywhere.
class LookingForDepth final : public mcap::Visitor {
 public:
  bool found = false;

  void metadata(std::string_view, mcap::Pairs) override {}
  void attachment(const mcap::AttachmentRecord&) override {}
  void channel(const mcap::Channel& channel) override {
    found = found || channel.topic == kChannelName<DepthRecord>.topic;
    some_ = true;
  }
  void messages() override { all_ = some_; }
  std::string message(const mcap::Message&) override { return ""; }
  void chunk(std::uint64_t, std::uint64_t) override {}
  bool enough() const override { return found || all_; }

 private:
  bool some_ = false;  ///< channels have been seen
  bool all_ = false;   ///< no more channels are expected
};

}  // namespace

bool hasDepthChannel(const std::filesystem::path& trace) {
  LookingForDepth looking;
  (void)mcap::read(trace, looking);  // faults are reported by whoever reads the trace
  return looking.found;
}

}  // namespace hapticd::drivers
